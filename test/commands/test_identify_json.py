# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` as programs use it: its object of JSON, and its options."""

import dataclasses
import gzip
import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from answers import KEYS, PARAMETER_KEYS, column, none_for_nan, values

from valve_friction_ros.commands.identify import as_json
from valve_friction_ros.identification import (
    PARAMETER_UNITS,
    UNITS,
    IdentificationSettings,
    identify_bench,
    published_estimate,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
)

POSITION_BIAS = 1.13e-3
FOUR_COLUMNS = ["--position-bias", str(POSITION_BIAS)]
SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file
BENCH = ("--method", "bench")
PNG = b"\x89PNG\r\n\x1a\n"


def run(*arguments, code="from valve_friction_ros.commands.main import main"):
    """Run the command as a process of its own; without `code`, as `python -m` does."""
    module = ["-m", "valve_friction_ros"]
    how = module if code is None else ["-c", f"import sys; {code}; sys.exit(main())"]
    return subprocess.run(
        [sys.executable, *how, "identify", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture(scope="session")
def result(quick_record):
    return identify_bench(quick_record, BENCH_VALVE, SETTINGS)


class TestProcesses:
    """As typed into a shell."""

    def test_json_of_the_bench_record(self, write_csv, columns_of, square_record, bench_options):
        """What is asked of noise-free records, and the very numbers of the library."""
        path = write_csv(columns_of(square_record))
        done = run(path, *bench_options, *FOUR_COLUMNS, *BENCH, "--json", code=None)
        assert (done.returncode, done.stderr) == (0, "")
        answer = json.loads(done.stdout)
        published = column(answer, "published")
        for found in (published, values(answer)):
            for name in ("viscous_friction", "coulomb_friction", "spring_constant"):
                assert found[name] == pytest.approx(getattr(LOW_FRICTION, name), rel=1e-3)
        assert published["mass"] == pytest.approx(LOW_FRICTION.mass, rel=0.1)
        settings = IdentificationSettings(position_bias=POSITION_BIAS)
        expected = published_estimate(square_record, BENCH_VALVE, settings)
        assert published.pop("sliding_friction") is None
        assert published == expected.values
        assert answer["evidence"]["threshold"] == expected.threshold
        assert answer["model_describes"] is True

    def test_without_ros(self, quick_csv, bench_options, tmp_path):
        """Not even a figure needs rclpy, nor the global state of matplotlib."""
        blocked = (
            "sys.modules['rclpy'] = sys.modules['matplotlib.pyplot'] = None; "
            "from valve_friction_ros.commands.main import main"
        )
        picture = tmp_path / "record.png"
        done = run(quick_csv, *bench_options, "--plot", picture, code=blocked)
        assert (done.returncode, done.stderr) == (0, "")
        assert "coulomb_friction" in done.stdout
        assert picture.read_bytes().startswith(PNG)

    def test_one_line_for_a_bad_file(self, tmp_path, bench_options):
        """Not even a warning of a library stands beside it."""
        path = tmp_path / "record.csv"
        path.write_text("time_s,position_m,pressure_pa\n")
        done = run(path, *bench_options)
        assert (done.returncode, done.stdout) == (2, "")
        assert re.fullmatch(r"valve_friction identify: \S+record\.csv: .+\n", done.stderr)


class TestJson:
    def test_the_result_of_the_library(self, printed, quick_csv, result, bench_options):
        answer = printed(quick_csv, *bench_options, *BENCH)
        assert set(answer) == KEYS | {"diagnosis", "findings"}
        assert list(answer["parameters"]) == [*UNITS, "sliding_friction"]
        assert answer["sliding_speed"] == result.sliding_speed
        for name, entry in answer["parameters"].items():
            expected = result.parameters[name]
            assert entry == {
                "value": none_for_nan(expected.value),
                "standard_error": none_for_nan(expected.standard_error),
                "half_width": none_for_nan(expected.half_width),
                "interval": [none_for_nan(end) for end in expected.interval],
                "verdict": expected.verdict.value,
                "reason": expected.reason,
                "published": result.estimate.values.get(name),
                "unit": PARAMETER_UNITS[name],
            }
        assert answer["fit"] == result.misfit.fit
        assert answer["rms"] == result.misfit.rms
        assert answer["systematic_misfit"] == result.misfit.systematic
        assert answer["model_describes"] is True
        assert answer["derivative_window"] == result.derivative_window
        assert answer["settings"]["derivative_window"] is None
        assert answer["settings"]["assumed_mass"] == 1.6

    def test_the_published_estimate_beside_it(
        self, printed, quick_csv, quick_record, bench_options
    ):
        answer = printed(quick_csv, *bench_options, *BENCH)
        expected = published_estimate(quick_record, BENCH_VALVE, SETTINGS)
        assert column(answer, "published") == {**expected.values, "sliding_friction": None}
        for key in ("threshold", "samples", "sigma", "r_squared"):
            assert answer["evidence"][key] == getattr(expected, key)
        assert answer["evidence"]["published_window"] == 31

    def test_a_number_without_a_verdict_is_never_shown(self, printed, quick_csv, bench_options):
        """What the record does not tell is null throughout, with the reason beside it."""
        answer = printed(quick_csv, *bench_options, *BENCH)
        assert {name for name, value in values(answer).items() if value is None} == {
            "mass",
            "static_friction",
        }
        for entry in answer["parameters"].values():
            assert set(entry) == PARAMETER_KEYS
            numbers = [entry["value"], entry["standard_error"], *entry["interval"]]
            if entry["verdict"] == "not identifiable":
                assert numbers == [None] * 4
                assert entry["reason"]
            else:
                assert entry["verdict"] in ("identified", "weak", "fixed")
                low, high = entry["interval"]
                assert low < entry["value"] < high
        mass = answer["parameters"]["mass"]
        assert mass["reason"].endswith("; 1.6 kg assumed")
        assert mass["published"] == 1.6  # assumed there as well

    def test_without_a_published_estimate(self, result):
        """The rest of the answer does not depend on it."""
        parameters = {
            name: dataclasses.replace(one, published=math.nan)
            for name, one in result.parameters.items()
        }
        alone = dataclasses.replace(result, parameters=parameters, warnings=("no answer",))
        answer = as_json(alone)
        assert set(answer) == KEYS
        assert set(column(answer, "published").values()) == {None}
        assert values(answer) == values(as_json(result))
        assert answer["evidence"]["threshold"] == result.estimate.threshold
        assert answer["warnings"] == ["no answer"]

    def test_gzipped(self, printed, quick_csv, bench_options):
        packed = quick_csv.with_name("record.csv.gz")
        packed.write_bytes(gzip.compress(quick_csv.read_bytes()))
        assert printed(packed, *bench_options) == printed(quick_csv, *bench_options)

    def test_other_headers(self, printed, quick_csv, write_csv, quick_record, bench_options):
        path = write_csv(
            {
                "note": np.full(len(quick_record), math.nan),
                "p": quick_record.pressure,
                "x": quick_record.position,
                "t": np.round(quick_record.time, 9),
            },
            "other.csv",
        )
        names = ["--time-column", "t", "--position-column", "x", "--pressure-column", "p"]
        found, plain = (printed(one, *bench_options, *names[: 6 * (one is path)]) for one in
                        (path, quick_csv))  # fmt: skip
        told = found["warnings"].pop(0)
        assert told.endswith("pressure 'p' in Pa, position 'x' in m")
        assert found == plain
