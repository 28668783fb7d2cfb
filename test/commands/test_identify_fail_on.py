# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The exit code for the diagnosis, and frictions that are all given."""

import json

import pytest

ALL = ("mass=1.542", "viscous_friction=4865", "coulomb_friction=152.7", "spring_constant=2.05e5")
METHOD = ("--method", "bench")


@pytest.mark.parametrize(
    ("baseline", "level", "fail_on", "code"),
    [
        (152.7, "OK", "warn", 0),
        (100.0, "WARN", "warn", 3),
        (100.0, "WARN", "error", 0),
        (50.0, "ERROR", "warn", 3),
        (50.0, "ERROR", "error", 3),
        (50.0, "ERROR", None, 0),
    ],
)
def test_the_diagnosis_may_fail_the_command(
    call, quick_csv, bench_options, baseline, level, fail_on, code
):
    options = ["--baseline-coulomb-friction", baseline, *METHOD, "--json"]
    options += ["--fail-on", fail_on] if fail_on else []
    found, out, err = call(quick_csv, *bench_options, *options)
    assert (found, err) == (code, "")
    assert json.loads(out)["diagnosis"]["level"] == level


def test_without_a_baseline_nothing_was_compared(call, quick_csv, bench_options):
    code, out, err = call(quick_csv, *bench_options, *METHOD, "--fail-on", "warn")
    assert code == 0
    assert out.splitlines()[-1].startswith("unknown: no baseline yet; ")
    assert err == (
        "valve_friction identify: --fail-on: there is no baseline, so no friction was compared: "
        "give --baseline-recording or --baseline-coulomb-friction\n"
    )


@pytest.mark.parametrize("method", ["plant", "bench", "published"])
def test_all_parameters_are_given(call, quick_csv, bench_options, method):
    """Nothing is left to identify; the model is compared with the record all the same.

    The published method adds an F_s of its own, with which its model may not move at all.
    """
    given = [option for one in (*ALL, "spring_preload=231.65") for option in ("--fix", one)]
    code, out, err = call(quick_csv, *bench_options, *given, "--method", method, "--json")
    assert (code, err) == (0, "")
    answer = json.loads(out)
    assert answer["parameters"]["coulomb_friction"]["verdict"] == "fixed"
    assert answer["fit"] > 0.99 or method == "published"
