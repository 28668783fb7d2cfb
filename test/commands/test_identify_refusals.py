# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the sub-command `identify` refuses, with one line and exit code 2."""

import math

import numpy as np
import pytest

from valve_friction_ros.model import BENCH_VALVE, Recording, simulate


class TestBadRecords:
    """What the file holds is no record, or no record of a moving valve."""

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (
                lambda c: c.update({name: [] for name in c}),
                "cannot tell what it holds: there are no",
            ),
            (
                lambda c: c.update({k: v[:309] for k, v in c.items()}),
                "the record is too short: 309 s",
            ),
            (
                lambda c: c["position_m"].fill(0.01),
                "the stem did not move: its position spans 0 µm",
            ),
            (lambda c: c["position_m"].sort(), "the stem moved up only"),
            (
                lambda c: c["position_m"].put(range(50, 150), math.nan),
                "row 52, column 'position_m': 'nan' is no good value, and so are 100 of 1000",
            ),
            (
                lambda c: c["time_s"].put(50, 0.49),
                "row 52, column 'time_s' repeats (0.49 s after 0.49 s)",
            ),
            (
                lambda c: c["time_s"].put(50, 0.48),
                "row 52, column 'time_s' goes back (0.48 s after 0",
            ),
            (
                lambda c: c["time_s"].__iadd__(0.2 * (np.arange(1000) >= 50)),
                "row 52, column 'time_s': gap of 0.21 s",
            ),
            (
                lambda c: c["pressure_pa"].put(50, 250000.5),
                "row 52, column 'pressure_pa': 250000 Pa is outside the sensor's range 0 to 250000",
            ),
            (lambda c: c.pop("time_s"), "cannot tell which column is the time, of position_m, "),
            (lambda c: c.pop("pressure_pa"), "cannot tell which column is the pressure, of "),
        ],
        ids=[
            "empty",
            "short",
            "never moved",
            "one way",
            "nan",
            "repeated",
            "backward",
            "gap",
            "range",
            "no time",
            "no pressure",
        ],
    )
    def test_refused(
        self, refusal, write_csv, columns_of, quick_record, bench_options, change, message
    ):
        columns = {name: np.array(column) for name, column in columns_of(quick_record).items()}
        change(columns)
        path = write_csv(columns)
        method = ["--method", "published"] if "gap" in message else []
        assert refusal(path, *bench_options, *method).startswith(f"{path}: {message}")

    def test_no_file(self, refusal, tmp_path, bench_options):
        path = tmp_path / "none.csv"
        expected = f"{path}: cannot be read as CSV: No such file or directory"
        assert refusal(path, *bench_options) == expected

    def test_a_record_that_is_too_short_for_the_window(self, refusal, quick_csv, bench_options):
        message = refusal(quick_csv, *bench_options, "--derivative-window", 101)
        assert message.startswith(f"{quick_csv}: the record is too short: 1000 samples")


def glide(record, share):
    """Positions of `record` at the lower stop but for a share of it."""
    above = record.position - record.position.min()
    return np.where(np.arange(len(record)) < share * len(record), above, 0.0)


class TestRecordsThatCannotTell:
    """Whole records that are refused, with what to do about it."""

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (
                lambda r: {"position_m": 1e3 * r.position},
                "the stem position runs from 3.691 to 23.89 m, the travel from 0 to 0.02857 m: "
                "check that the signals are not swapped, and check unit (m)",
            ),
            (
                lambda r: {"position_m": glide(r, 0.4)},
                "pressure and stem do not move together ",
            ),
            (
                lambda r: {"position_m": BENCH_VALVE.travel - glide(r, 0.4)},
                "pressure and stem do not move together ",
            ),
            (
                lambda r: {"position_m": 0.028 - r.position},
                "the stem moves against the pressure: invert the position",
            ),
            (
                lambda r: {"pressure_pa": np.roll(r.pressure, len(r) // 4)},
                "no friction model reproduces the record (fit ",
            ),
            (
                lambda r: {"pressure_pa": np.full(len(r), 1e5)},
                "the pressure did not change: excite the valve, or check the pressure sensor",
            ),
        ],
        ids=[
            "millimetres",
            "lower stop",
            "upper stop",
            "against",
            "a quarter period apart",
            "dead",
        ],
    )
    @pytest.mark.parametrize("how", ["table", "json"])
    def test_refused(
        self, refusal, write_csv, columns_of, quick_record, bench_options, change, message, how
    ):
        path = write_csv(columns_of(quick_record) | change(quick_record))
        options = ["--json"] if how == "json" else []
        assert refusal(path, *bench_options, *options).startswith(f"{path}: {message}")

    def test_sampled_too_slowly(self, refusal, write_csv, columns_of, benches, bench_options):
        """Ten samples a second of a stem that crosses its range within one of them."""
        pressure = np.where(np.arange(400) // 20 % 2, 160e3, 64e3)
        position = simulate(*benches["low"], pressure, 0.1).position
        path = write_csv(columns_of(Recording(0.1, pressure, position)))
        message = refusal(path, *bench_options)
        assert message.startswith(f"{path}: sampling is too slow for the motion: the stem moves ")
        assert "0.1 s apart; sample faster" in message

    def test_no_picture_is_left(self, refusal, write_csv, columns_of, quick_record, bench_options):
        path = write_csv(columns_of(quick_record) | {"position_m": 0.028 - quick_record.position})
        refusal(path, *bench_options, "--plot", path.with_suffix(".png"))
        assert not path.with_suffix(".png").exists()


class TestBadOptions:
    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("travel: 0.03", "diaphragm_area is missing"),
            ("diaphragm_area: -1.0", "diaphragm_area must be above zero, got -1"),
            ("diaphragm_area: wide", "diaphragm_area must be a number, got 'wide'"),
            ("diaphragm_area: 1.0\nmass: -1.0", "mass must be above zero, got -1"),
            ("diaphragm_area: 1.0\npressure_minimum: low", "pressure_minimum must be a number"),
            (
                "diaphragm_area: 1.0\nstatic_friction: 5.0\ncoulomb_friction: 6.0",
                "static_friction (5) must not be below coulomb_friction (6)",
            ),
            ("diaphragm_area: 1.0\nmas: 1.0", "unknown key 'mas'; did you mean 'mass'?"),
            ("diaphragm_area: [", "not YAML: while parsing"),
        ],
    )
    def test_valve_file(self, refusal, quick_csv, tmp_path, text, message):
        path = tmp_path / "valve.yaml"
        path.write_text(text)
        assert refusal(quick_csv, "--valve", path).startswith(f"{path}: {message}")

    def test_no_valve_file_for_a_pressure(self, refusal, quick_csv):
        assert refusal(quick_csv) == (
            "pressure needs the diaphragm_area: give a valve file by --valve; "
            "`valve_friction describe-valve` writes one"
        )

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            (["--fix", "mass=heavy"], "--fix mass=heavy: 'heavy' is not a number"),
            (
                ["--fix", "spring_constant"],
                "--fix spring_constant: give a value, as spring_constant=",
            ),
            (
                ["--fix", "weight=1"],
                "'weight' is not a parameter that can be fixed; choose from mass",
            ),
            (
                ["--fix", "coulomb_fricton=400"],
                "'coulomb_fricton' is not a parameter that can be fixed; "
                "did you mean 'coulomb_friction'?",
            ),
            (["--fix", "mass=1", "--fix", " mass =2"], "--fix mass is given twice"),
            (["--fix", "mass", "--fix", "mass"], "--fix mass is given twice"),
            (["--fix", "mass=-1"], "mass must be above zero, got -1"),
            (["--fix", "mass=nan"], "mass must be finite, got nan"),
            (
                ["--derivative-window", "30"],
                "derivative_window must be odd and at least order + 2 = 5, got 30",
            ),
            (
                ["--derivative-window", "3"],
                "derivative_window must be odd and at least order + 2 = 5, got 3",
            ),
            (["--order", "1"], "order must be at least 2 for an acceleration, got 1"),
            (["--position-bias", "nan"], "position_bias must be finite, got nan"),
            (
                ["--position-bias", "0.001", "--fix", "spring_preload=1"],
                "position_bias and a fixed spring_preload exclude each other",
            ),
        ],
    )
    def test_refused(self, refusal, quick_csv, bench_options, options, message):
        assert refusal(quick_csv, *bench_options, *options).startswith(message)
