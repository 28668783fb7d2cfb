# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` without `--method`: the imperfections of a plant in the fit."""

import math

import numpy as np
import pytest
from answers import KEYS, column, none_for_nan, row_of, values

from valve_friction_ros.identification import (
    CALIBRATION,
    UNITS,
    IdentificationSettings,
    identify_plant,
    published_estimate,
)
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SensorNoise

SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file


@pytest.fixture(scope="module")
def noisy(quick_record):
    return SensorNoise(position=10e-6, pressure=100.0, seed=1).applied_to(quick_record)


@pytest.fixture
def path(write_csv, columns_of, noisy):
    return write_csv(columns_of(noisy))


def test_the_result_of_the_library(printed, path, noisy, bench_options):
    answer = printed(path, *bench_options)
    expected = identify_plant(noisy, BENCH_VALVE, SETTINGS)
    assert set(answer) == KEYS | {"diagnosis", "findings"}
    assert answer["method"] == expected.method == "plant"
    assert [*answer["parameters"]] == [*UNITS, "sliding_friction"]
    for name, entry in answer["parameters"].items():
        one = expected.parameters[name]
        assert (entry["verdict"], entry["reason"]) == (one.verdict.value, one.reason)
        assert entry["value"] == pytest.approx(none_for_nan(one.value), rel=1e-9)
        assert entry["half_width"] == pytest.approx(none_for_nan(one.half_width), rel=1e-9)
    assert answer["derivative_window"] == 0
    assert answer == printed(path, *bench_options, "--method", "plant")
    assert answer == printed(path, *bench_options, "--method", "best")


def test_the_published_estimate_beside_it(printed, call, path, noisy, bench_options):
    answer = printed(path, *bench_options)
    expected = published_estimate(noisy, BENCH_VALVE, SETTINGS)
    published = column(answer, "published")
    assert published.pop("sliding_friction") is None
    assert published == pytest.approx(expected.values, rel=1e-9)
    assert answer["evidence"]["threshold"] == pytest.approx(expected.threshold, rel=1e-9)
    out = call(path, *bench_options)[1]
    assert row_of(out, "coulomb_friction").endswith(f" {expected.values['coulomb_friction']:.6g}")


def test_a_known_static_friction_is_refused(refusal, path, bench_options):
    assert refusal(path, *bench_options, "--fix", "static_friction=150") == (
        f"{path}: the method plant finds F_s itself and takes no known one: leave it out, or use "
        "the method published"
    )


class TestGap:
    """Fifty samples are lost in the middle of a stroke."""

    @pytest.fixture
    def broken(self, write_csv, columns_of, noisy):
        kept = np.r_[0:400, 450 : len(noisy)]
        columns = {name: column[kept] for name, column in columns_of(noisy).items()}
        return write_csv(columns, "broken.csv")

    def test_it_costs_the_stretch_around_it(self, printed, broken, bench_options):
        answer = printed(broken, *bench_options)
        assert answer["method"] == "plant"
        for name in ("coulomb_friction", "spring_constant"):
            low, high = answer["parameters"][name]["interval"]
            assert low < getattr(LOW_FRICTION, name) < high, name
        friction = answer["parameters"]["coulomb_friction"]
        assert friction["half_width"] < 0.25 * friction["value"]  # the first alarm
        left_out = [note for note in answer["warnings"] if note.endswith(" left out")]
        assert len(left_out) == 2
        assert {entry["published"] for entry in answer["parameters"].values()} == {None}

    @pytest.mark.parametrize("method", ["published", "signature"])
    def test_the_others_refuse_it(self, refusal, broken, bench_options, method):
        assert refusal(broken, *bench_options, "--method", method).startswith(
            f"{broken}: row 402, column 'time_s': gap of 0.51 s: use a stretch of the record"
        )

    def test_no_model_is_validated_through_it(
        self, command, call, broken, path, bench_options, tmp_path
    ):
        estimate = tmp_path / "estimate.json"
        bench = [*bench_options, "--timing-uncertainty", "0"]
        estimate.write_text(call(path, *bench, "--json")[1])
        code, out, err = command("validate", broken, *bench_options, "--estimate", estimate)
        assert (code, out) == (2, "")
        assert "gap of 0.51 s" in err


def timing(answer):
    """The share of the lag in the standard uncertainty of each parameter."""
    return {name: one["timing"] for name, one in answer["evidence"]["uncertainty_budget"].items()}


class TestTimingUncertainty:
    def test_it_reaches_the_settings(self, printed, path, bench_options):
        found = printed(path, *bench_options, "--timing-uncertainty", "0.005")
        assert found["settings"]["timing_uncertainty"] == 0.005
        assert printed(path, *bench_options)["settings"]["timing_uncertainty"] is None

    def test_signals_that_surely_belong_together_have_no_share(self, printed, path, bench_options):
        """And leave the work of friction less uncertain; all values are finite still."""
        sure = printed(path, *bench_options, "--timing-uncertainty", "0")
        unsure = printed(path, *bench_options, "--timing-uncertainty", "0.08")
        assert set(timing(sure).values()) == {0.0}
        for name in ("viscous_friction", "sliding_friction"):
            assert timing(unsure)[name] > 0, name
        widths = [one["parameters"]["sliding_friction"]["half_width"] for one in (sure, unsure)]
        assert 0 < widths[0] < widths[1]
        known = [value for value in values(sure).values() if value is not None]
        assert all(map(math.isfinite, known))

    @pytest.mark.parametrize("text", ["-0.01", "nan", "inf"])
    def test_impossible(self, refusal, path, bench_options, text):
        assert refusal(path, *bench_options, f"--timing-uncertainty={text}").startswith(
            "timing_uncertainty must"
        )


class TestCalibration:
    OPTIONS = ("--area-uncertainty=0.01", "--drive-scale-uncertainty=0.02")

    def test_it_reaches_settings_intervals_and_budget(self, printed, path, bench_options):
        exact = [*bench_options, "--timing-uncertainty", "0"]
        found = printed(path, *exact, *self.OPTIONS, "--position-scale-uncertainty=0.03")
        known = printed(path, *exact)["parameters"]["spring_constant"]
        settings = found["settings"]
        assert [settings[name] for name in CALIBRATION] == [0.01, 0.02, 0.03]
        spring = found["parameters"]["spring_constant"]
        error = math.hypot(0.01, 0.02, 0.03) * known["value"]
        assert spring["value"] == known["value"]
        assert spring["half_width"] == pytest.approx(math.hypot(known["half_width"], 2 * error))
        budget = found["evidence"]["uncertainty_budget"]["spring_constant"]
        assert budget["calibration"] == pytest.approx(error)

    @pytest.mark.parametrize("text", ["-0.01", "nan", "2"])
    def test_impossible(self, refusal, path, bench_options, text):
        assert refusal(path, *bench_options, f"--area-uncertainty={text}").startswith(
            "area_uncertainty must"
        )
