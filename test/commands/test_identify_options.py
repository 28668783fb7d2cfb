# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The options of the sub-command `identify`."""

import math
import re

import pytest
from answers import column, known, values

from valve_friction_ros.identification import IdentificationSettings, identify_bench
from valve_friction_ros.model import BENCH_VALVE

POSITION_BIAS = 1.13e-3
FOUR_COLUMNS = ["--position-bias", str(POSITION_BIAS)]

BENCH = ("--method", "bench")


class TestOptions:
    def test_fixed_by_value_and_by_name(self, printed, quick_csv, bench_options):
        answer = printed(
            quick_csv, *bench_options, "--fix", "spring_constant=2.05e5", "--fix", "mass"
        )
        fixed = {name for name, verdict in column(answer, "verdict").items() if verdict == "fixed"}
        assert fixed == {"spring_constant", "mass"}
        assert values(answer)["spring_constant"] == 2.05e5
        assert values(answer)["mass"] == 1.6  # of the valve file
        assert answer["warnings"] == []
        for name in fixed:
            entry = answer["parameters"][name]
            assert entry["standard_error"] == 0.0
            assert entry["interval"] == [entry["value"]] * 2
            assert entry["published"] == entry["value"]

    def test_threshold(self, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, "--fix", "limit_velocity=0.002")
        assert answer["evidence"]["threshold"] == 0.002

    def test_position_bias(self, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, *FOUR_COLUMNS)
        found = column(answer, "published")
        assert found["spring_preload"] == pytest.approx(
            found["spring_constant"] * POSITION_BIAS, rel=1e-12
        )
        assert values(answer) == values(printed(quick_csv, *bench_options))

    def test_window_and_order_are_those_of_the_published_estimate(
        self, printed, quick_csv, quick_record, bench_options
    ):
        answer = printed(quick_csv, *bench_options, *BENCH, "--derivative-window", 15, "--order", 4)
        settings = IdentificationSettings(derivative_window=15, order=4, assumed_mass=1.6)
        assert answer["evidence"]["published_window"] == 15
        assert answer["settings"]["order"] == 4
        expected = identify_bench(quick_record, BENCH_VALVE, settings)
        assert column(answer, "published") == {**expected.estimate.values, "sliding_friction": None}
        assert known(answer) == {
            name: value for name, value in expected.values.items() if not math.isnan(value)
        }

    def test_valve(self, printed, quick_csv, bench_options, tmp_path):
        """Twice the area is twice the force, and so is every parameter; 2 rounds nothing."""
        path = tmp_path / "valve.yaml"
        path.write_text("diaphragm_area: 0.089\npressure_reference: 41740.0\n")
        once = printed(quick_csv, *bench_options, *BENCH, "--fix", "mass=1.6")
        twice = printed(quick_csv, "--valve", path, *BENCH, "--fix", "mass=3.2")
        doubled = {name: value and 2 * value for name, value in column(once, "published").items()}
        assert column(twice, "published") == doubled
        assert known(twice) == pytest.approx(
            {name: 2 * value for name, value in known(once).items()}, rel=1e-6
        )

    def test_what_the_valve_file_states_is_compared(self, call, printed, quick_csv, tmp_path):
        """Twice the area of the bench valve, with the spring of its data sheet."""
        path = tmp_path / "valve.yaml"
        text = "diaphragm_area: 0.089\npressure_reference: 41740.0\nspring_constant: 2.05e5\n"
        path.write_text(text)
        answer = printed(quick_csv, "--valve", path)
        found = answer["evidence"]["contradicted_data"]["spring_constant"]
        assert (found["cause"], found["stated"]) == ("area scale", 2.05e5)
        assert found["factor"] == pytest.approx(2.0, rel=1e-2)
        assert "check diaphragm_area (doubled)" in answer["warnings"][0]
        assert "identified" not in column(answer, "verdict").values()
        _, out, _ = call(quick_csv, "--valve", path)
        assert f"note: {answer['warnings'][0]}" in " ".join(out.split())
        path.write_text(text.replace("0.089", "0.0445"))
        fixed = printed(quick_csv, "--valve", path, "--fix", "spring_constant")
        assert fixed["settings"]["stated"] == {}
        assert "contradicted_data" not in fixed["evidence"]

    @pytest.mark.parametrize("header", ["force_n", "F [N]"])
    def test_force(
        self, printed, write_csv, columns_of, quick_record, quick_csv, bench_options, header
    ):
        """The actuator's force in the file, and no valve file: the same sums, the same result."""
        columns = columns_of(quick_record)
        pressure = columns.pop("pressure_pa")
        path = write_csv(columns | {header: BENCH_VALVE.actuator_force(pressure)}, "force.csv")
        found = printed(path, "--force-column", header, *BENCH, "--fix", "mass=1.6")
        expected = printed(quick_csv, *bench_options, *BENCH, "--fix", "mass=1.6")
        assert column(found, "published") == column(expected, "published")
        assert column(found, "verdict") == column(expected, "verdict")
        assert known(found) == pytest.approx(known(expected), rel=1e-6)
        for answer in (found, expected):
            del answer["settings"]["assumed_mass"]  # of the valve file
        # How a table of other headers was read is noted.
        assert [one.partition(":")[0] for one in found.pop("warnings")] in ([], ["read as"])
        del expected["warnings"]
        assert found["sliding_speed"] == pytest.approx(expected["sliding_speed"], rel=1e-9)
        close = ("parameters", "evidence", "fit", "rms", "systematic_misfit", "sliding_speed")
        first_survey = ("diagnosis", "findings")  # by the travel, which the valve file tells
        assert [expected.pop(one, None) is not None for one in first_survey] == [True, True]
        assert {key: found[key] for key in found if key not in close} == {
            key: expected[key] for key in expected if key not in close
        }

    def test_help_names_all(self, call, capsys):
        with pytest.raises(SystemExit) as ended:
            call("--help")
        assert ended.value.code == 0
        options = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
        columns = {f"--{name}-column" for name in ("time", "position", "pressure", "force")}
        method = {"--method", "--fix", "--position-bias", "--derivative-window", "--order"}
        assert options >= columns | method | {"--valve", "--plot", "--report", "--json"}
