# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Each wrong unit of a record or of a valve file is named, and no right one is questioned."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    identify,
    require_valve_units,
)
from valve_friction_ros.identification.trust.plausible_units import (
    require_plausible_units,
    time_remarks,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Drive,
    Recording,
    SquareWave,
    Valve,
    converter_response,
    simulate,
)

DEFAULTS = IdentificationSettings()
PASCALS = {"kPa": 1e3, "bar": 1e5, "mbar": 100.0, "psi": 6894.76, "MPa": 1e6}
METRES = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254}
SQUARE_METRES = {"cm²": 1e-4, "in²": 6.4516e-4, "mm²": 1e-6}

SPRING_RANGES = [
    (0.2e5, 1.0e5),  # 3 to 15 psi, and 0.2 to 1 bar
    (0.2e5, 2.1e5),
    (0.4e5, 2.0e5),  # 6 to 30 psi
    (0.8e5, 2.4e5),
    (1.5e5, 3.8e5),
    (2.0e5, 5.5e5),
]
"""Bench sets of the catalogues of SAMSON (3271, 3277), Fisher (657, 667) and Masoneilan (87)."""

AREAS = [0.0060, 0.0120, 0.0240, 0.0297, 0.0350, 0.0445, 0.0700, 0.1000, 0.1806, 0.2800, 0.5600]
"""Effective areas, m²: SAMSON 60 to 2 × 2800 cm², Fisher 46 to 280 in²."""

TRAVELS = [0.005, 0.0075, 0.0127, 0.015, 0.01905, 0.028575, 0.03, 0.0381, 0.06, 0.089, 0.12, 0.15]
"""Rated travels, m, of the same catalogues."""


def strokes(low, high, travel=math.inf, area=0.0445, absolute=False):
    """A record between two pressures, gauge or absolute, and the valve that made it."""
    reference = 101_325.0 if absolute else 0.0
    share = np.clip(0.5 - 0.5 * np.cos(np.arange(3000) * 2 * np.pi / 600), 0.03, 0.97)
    stroke = travel if math.isfinite(travel) else 0.03
    valve = Valve(diaphragm_area=area, travel=travel, pressure_reference=reference)
    return Recording(0.02, reference + low + (high - low) * share, stroke * share), valve


def refusal(recording, valve):
    with pytest.raises(RefusalError) as caught:
        require_plausible_units(recording, valve, DEFAULTS)
    return str(caught.value)


class TestRight:
    @pytest.mark.parametrize("absolute", [False, True])
    @pytest.mark.parametrize("pressures", SPRING_RANGES)
    @pytest.mark.parametrize("area", AREAS)
    def test_catalogue(self, pressures, area, absolute):
        for travel in (*TRAVELS, math.inf):
            recording, valve = strokes(*pressures, travel, area, absolute)
            require_plausible_units(recording, valve, DEFAULTS)

    @given(
        low=st.floats(0.1e5, 4e5),
        span=st.floats(2e3, 4e5),
        area=st.floats(0.005, 0.56),
        travel=st.floats(0.005, 0.15),
        part=st.floats(0.02, 1.0),
    )
    @settings(max_examples=60, deadline=None)
    def test_anything_between(self, low, span, area, travel, part):
        recording, valve = strokes(low, low + span, travel, area)
        small = Recording(0.02, recording.drive, recording.position * part)
        require_plausible_units(small, valve, DEFAULTS)

    def test_what_is_no_valve_is_not_judged(self):
        recording, valve = strokes(1.0, 2.0)
        springless = IdentificationSettings(fixed={"spring_constant": 0.0})
        require_plausible_units(recording, valve, springless)
        force = Recording(0.02, recording.drive, recording.position, driven_by=Drive.FORCE)
        require_plausible_units(force, Valve(), DEFAULTS)


class TestWrong:
    @pytest.mark.parametrize("pressures", SPRING_RANGES)
    @pytest.mark.parametrize("unit", PASCALS)
    def test_pressure(self, unit, pressures):
        recording, valve = strokes(*pressures)
        wrong = Recording(0.02, recording.drive / PASCALS[unit], recording.position)
        message = refusal(wrong, valve)
        assert unit in message.split(": ")[1].removesuffix(" read as Pa?").split(" or ")

    def test_pressure_in_percent(self):
        recording, valve = strokes(0.0, 100.0)
        assert "% read as Pa?" in refusal(recording, valve)

    def test_pascals_that_were_read_as_another_unit(self):
        recording, valve = strokes(0.4e5, 2e5)
        for size in PASCALS.values():
            wrong = Recording(0.02, recording.drive * size, recording.position)
            assert "more than in any control valve" in refusal(wrong, valve)

    @pytest.mark.parametrize("travel", TRAVELS)
    @pytest.mark.parametrize("unit", METRES)
    def test_position(self, unit, travel):
        recording, valve = strokes(0.4e5, 2e5, travel)
        wrong = Recording(0.02, recording.drive, recording.position / METRES[unit])
        with pytest.raises(RefusalError) as caught:
            identify(wrong, valve)
        assert unit in str(caught.value).split(": ")[-1]

    def test_position_in_percent(self):
        recording, valve = strokes(0.4e5, 2e5, 0.028)
        share = 100 * recording.position / 0.028
        with pytest.raises(RefusalError, match="%"):
            identify(Recording(0.02, recording.drive, share), valve)

    def test_position_without_a_travel(self):
        recording, valve = strokes(0.4e5, 2e5)
        wrong = Recording(0.02, recording.drive, recording.position * 1e3)
        assert "mm" in refusal(wrong, valve).split(": ")[1]

    @pytest.mark.parametrize("area", AREAS)
    @pytest.mark.parametrize("unit", SQUARE_METRES)
    def test_area(self, unit, area):
        with pytest.raises(ValueError, match="diaphragm_area") as caught:
            require_valve_units(Valve(area / SQUARE_METRES[unit]), {})
        assert f"{unit} " in str(caught.value).split(": ")[1]

    @pytest.mark.parametrize("travel", TRAVELS)
    @pytest.mark.parametrize("unit", ["mm", "cm"])
    def test_travel(self, unit, travel):
        if travel / METRES[unit] < 0.7:
            pytest.skip("a long piston has that travel")
        with pytest.raises(ValueError, match="travel") as caught:
            require_valve_units(Valve(0.0445, travel=travel / METRES[unit]), {})
        assert f"{unit} " in str(caught.value).split(": ")[1]

    @pytest.mark.parametrize("value", [1.01325, 101.325, 14.696, 1013.25])
    def test_pressure_reference(self, value):
        with pytest.raises(ValueError, match=r"pressure_reference .*(bar|kPa|psi|mbar)"):
            require_valve_units(Valve(0.0445, pressure_reference=value), {})

    def test_spring_constant(self):
        with pytest.raises(ValueError, match="N/mm or kN/m"):
            require_valve_units(BENCH_VALVE, {"spring_constant": 205.0})


class TestTime:
    @staticmethod
    def bench(factor=1.0):
        """The square wave of the bench, 62 s at 100 Hz, with stamps in another unit."""
        time = 1e-2 * np.arange(6200)
        pressure = converter_response(SquareWave().sample(time), 1e-2)
        stem = simulate(BENCH_VALVE, LOW_FRICTION, pressure, sample_period=1e-2)
        noise = np.random.default_rng(0).standard_normal((2, time.size))
        return Recording(1e-2 * factor, pressure + 100 * noise[0], stem.position + 1e-5 * noise[1])

    def test_right(self):
        require_plausible_units(self.bench(), BENCH_VALVE, DEFAULTS)
        assert time_remarks(self.bench(), BENCH_VALVE) == ()

    @pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("µs", 1e6), ("ns", 1e9)])
    def test_too_slow(self, unit, factor):
        message = refusal(self.bench(factor), BENCH_VALVE)
        assert "lags behind the pressure" in message
        assert f"{unit} read as s?" in message

    def test_seconds_that_were_read_as_milliseconds(self):
        assert "s read as ms" in refusal(self.bench(1e-3), BENCH_VALVE)

    def test_minutes(self):
        (remark,) = time_remarks(self.bench(1 / 60), BENCH_VALVE)
        assert "min read as s" in remark

    @pytest.mark.parametrize("method", ["plant", "bench", "published"])
    def test_every_method_refuses(self, method):
        with pytest.raises(RefusalError, match="ms read as s"):
            identify(self.bench(1e3), BENCH_VALVE, method=method)
