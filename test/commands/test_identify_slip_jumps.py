# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` on a packing that slips."""

import dataclasses
import re

import numpy as np
import pytest
from answers import PARAMETER_KEYS, row_of

from valve_friction_ros.identification import (
    UNITS,
)
from valve_friction_ros.model import (
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    Recording,
    SensorNoise,
    SineWave,
    simulate,
)

SLIPPING = dataclasses.replace(GRAPHITE_PACKING, mass=1.6)
FALLING = dataclasses.replace(SLIPPING, stribeck_velocity=3.26e-3)
"""A published identification of a graphite packing."""


class TestSlipJumps:
    """Graphite packing: sixteen seconds of a sine at 100 Hz, 10 µm and 100 Pa of noise."""

    NAMES = ("coulomb_friction", "static_friction", "viscous_friction", "spring_constant")

    @pytest.fixture
    def options(self, tmp_path):
        path = tmp_path / "graphite.yaml"
        geometry = dataclasses.asdict(GRAPHITE_VALVE)
        path.write_text("\n".join(f"{name}: {value}" for name, value in geometry.items()))
        return ["--valve", path, "--fix", "mass=1.6", "--method", "bench"]

    @pytest.fixture
    def file_of(self, write_csv, columns_of):
        """Function of a packing and a delay of the stem's stamps (samples): its record."""

        def build(packing, delay=0):
            pressure = SineWave(period=4.0).sample(np.arange(1600) / 100)
            position = simulate(GRAPHITE_VALVE, packing, pressure, 0.01).position
            record = SensorNoise(10e-6, 100.0, seed=1).applied_to(
                Recording(0.01, pressure[delay:], position[: 1600 - delay])
            )
            return write_csv(columns_of(record))

        return build

    def assert_true(self, answer, packing):
        """The bounds of the whole benchmark: 5 %, and no error beyond three half widths."""
        for name in self.NAMES:
            entry, truth = answer["parameters"][name], getattr(packing, name)
            assert entry["verdict"] == "identified", name
            assert entry["value"] == pytest.approx(truth, rel=0.05)
            low, high = entry["interval"]
            assert abs(entry["value"] - truth) < 1.5 * (high - low)
        assert answer["model_describes"] is True
        assert answer["systematic_misfit"] < 10e-6

    def test_a_slip_jump_tells_the_static_friction(self, printed, file_of, options):
        answer = printed(file_of(SLIPPING), *options)
        self.assert_true(answer, SLIPPING)
        assert list(answer["parameters"]) == [*UNITS, "sliding_friction"]

    def test_a_fall_of_the_friction_is_told_with_its_speed(self, printed, file_of, options):
        answer = printed(file_of(FALLING), *options)
        self.assert_true(answer, FALLING)
        assert list(answer["parameters"]) == [*UNITS, "sliding_friction", "stribeck_velocity"]
        entry = answer["parameters"]["stribeck_velocity"]
        assert set(entry) == PARAMETER_KEYS
        assert (entry["unit"], entry["published"]) == ("m/s", None)
        low, high = entry["interval"]
        assert low < FALLING.stribeck_velocity < high

    def test_the_fall_in_the_table(self, call, file_of, options):
        """Between 2.9 and 3.6 mm/s, with its interval, and nothing published to compare with."""
        code, out, err = call(file_of(FALLING), *options)
        assert (code, err) == (0, "")
        row = row_of(out, "stribeck_velocity")
        assert re.fullmatch(
            r"stribeck_velocity 0\.00(29|3[0-6])\d+ \S+ m/s (identified|weak)", row
        ), row

    def test_late_stamps_are_reported(self, printed, file_of, options):
        """Ten samples, 100 ms, by the default; a bench has no lags."""
        path = file_of(SLIPPING, delay=10)
        lag = printed(path, *options[:-2])["evidence"]["imperfections"]["lag"]
        assert abs(lag["value"] - 0.1) < lag["half_width"] < 0.02
        assert printed(path, *options)["model_describes"] is False

    @pytest.mark.parametrize("packing", [SLIPPING, FALLING], ids=["slips", "falls"])
    def test_with_a_lag_in_the_intervals(self, printed, file_of, options, packing):
        """The default finds the same packing, and its wider intervals hold the truth."""
        parameters = printed(file_of(packing), *options[:-2])["parameters"]
        for name in self.NAMES:
            low, high = parameters[name]["interval"]
            assert low < getattr(packing, name) < high, name
        friction = parameters["coulomb_friction"]
        assert friction["half_width"] < 0.05 * friction["value"]
        if packing.stribeck_velocity > 0:
            low, high = parameters["stribeck_velocity"]["interval"]
            assert low < packing.stribeck_velocity < high
