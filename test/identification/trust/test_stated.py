# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Stated data of a valve against its record, and the unit that each wrong number is named by."""

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import valve_friction_ros as vf
from valve_friction_ros.identification import (
    IdentificationSettings,
    Parameter,
    RefusalError,
    Verdict,
    identify,
    require_valve_units,
)
from valve_friction_ros.identification.trust.plausible_units import (
    require_plausible_units,
    time_remarks,
)
from valve_friction_ros.identification.trust.stated import Cause, Contradiction, contradictions
from valve_friction_ros.identification.trust.verdict import fixed, not_identifiable, with_verdict
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

TYPED_AREA, SPRING, PRELOAD, ATMOSPHERE = 0.0445, 204941.0, 2000.0, 101325.0
VALVE = vf.Valve(diaphragm_area=TYPED_AREA, travel=28.575e-3)
PACKING = vf.KarnoppParameters(1.6, 4865.0, 400.0, 450.0, SPRING, PRELOAD)
STATED = {"spring_constant": SPRING, "spring_preload": PRELOAD}
FORCES = (
    "viscous_friction",
    "coulomb_friction",
    "static_friction",
    "sliding_friction",
    "spring_constant",
    "spring_preload",
)


def recorded(packing=PACKING):
    """A minute of a sine at 100 Hz with sensor noise; both stops stay out of reach."""
    time = np.arange(6000) / 100
    pressure = 1.1e5 + 5e4 * np.sin(2 * np.pi * time / 10)
    stem = vf.simulate(VALVE, packing, pressure, sample_period=0.01)
    return vf.SensorNoise(1e-5, 50.0, seed=1).applied_to(
        vf.Recording(0.01, pressure, stem.position)
    )


@pytest.fixture(scope="module")
def record():
    return recorded()


@cache
def _identified(record, method, stated, assumed, typed):
    settings = vf.IdentificationSettings(stated=dict(stated), assumed=assumed)
    return vf.identify(record, replace(VALVE, **dict(typed)), settings, method)


def identified(record, stated, method="plant", assumed=(), **typed):
    """Identify once for each choice of stated, assumed and typed data."""
    return _identified(record, method, (*stated.items(),), assumed, (*typed.items(),))


def told(result):
    return result.evidence.get("contradicted_data", {})


def verdicts(result):
    return {name: result.parameters[name].verdict for name in FORCES}


class TestOfARecord:
    @pytest.mark.parametrize("method", ["plant", "bench", "published"])
    def test_right_data_change_nothing(self, record, method):
        stated = {**STATED, "mass": 1.6}
        result, without = identified(record, stated, method), identified(record, {}, method)
        assert repr(result.parameters) == repr(without.parameters)  # nan equals itself there
        assert result.warnings == without.warnings
        assert told(result) == {}

    @pytest.mark.parametrize("method", ["plant", "bench"])
    def test_an_area_typed_twice_too_large(self, record, method):
        result = identified(
            record, {"spring_constant": SPRING}, method, diaphragm_area=2 * TYPED_AREA
        )
        (one,) = told(result).values()
        assert (one.name, one.cause, one.stated) == ("spring_constant", Cause.AREA_SCALE, SPRING)
        assert one.factor == pytest.approx(2.0, rel=1e-3)
        assert one.found == result.parameters["spring_constant"].value
        assert set(verdicts(result).values()) == {Verdict.WEAK}
        assert result.warnings[0] == (
            f"spring_constant is {one.found:.6g} N/m from the record but stated as 204941 N/m: "
            "check diaphragm_area (doubled) and the unit of the pressure; 0.0445 m² instead of "
            "0.089 m² would agree with the stated spring"
        )
        reason = result.parameters["coulomb_friction"].reason
        assert reason == (
            "the scale of the forces is in doubt: the stated spring_constant contradicts the record"
        )

    def test_gauge_for_absolute_pressure(self, record):
        """The finding's own: a gauge sensor with the reference of an absolute one."""
        result = identified(record, {"spring_preload": PRELOAD}, pressure_reference=ATMOSPHERE)
        (one,) = told(result).values()
        assert (one.name, one.cause) == ("spring_preload", Cause.ZERO_OF_PRESSURE)
        assert one.pressure == pytest.approx(-ATMOSPHERE, rel=1e-2)
        assert math.isnan(one.factor)
        assert set(verdicts(result).values()) == {Verdict.WEAK}
        assert result.warnings[0].endswith(
            "gauge pressure is being read as absolute pressure: set pressure_reference to 0 "
            "instead of 101325"
        )

    def test_a_spring_that_agrees_confirms_the_scale(self, record):
        """A wrong zero of the pressure then leaves the friction in newtons as it is."""
        result = identified(record, STATED, pressure_reference=ATMOSPHERE)
        assert [*told(result)] == ["spring_preload"]
        assert result.parameters["spring_preload"].verdict is Verdict.WEAK
        for name in ("coulomb_friction", "spring_constant"):
            assert result.parameters[name].verdict is Verdict.IDENTIFIED

    def test_the_ratio_to_a_baseline_stays(self, record):
        grown = recorded(replace(PACKING, coulomb_friction=600.0, static_friction=650.0))
        ratios = []
        for stated in ({}, {"spring_constant": SPRING}):
            healthy, now = (
                identified(one, stated, diaphragm_area=2 * TYPED_AREA) for one in (record, grown)
            )
            ratios.append(vf.compare(now, vf.Baseline.of(healthy)))
        without, doubted = ratios
        assert now.parameters["coulomb_friction"].verdict is Verdict.WEAK
        assert doubted.ratio == without.ratio
        assert doubted.level == without.level

    def test_as_text_and_json(self, record):
        result = identified(record, {"spring_constant": SPRING}, diaphragm_area=2 * TYPED_AREA)
        assert f"note: {result.warnings[0]}" in result.summary()
        shown = json.loads(json.dumps(result.to_dict(), allow_nan=False))
        assert shown["settings"]["stated"] == {"spring_constant": SPRING}
        one = shown["evidence"]["contradicted_data"]["spring_constant"]
        assert (one["cause"], one["pressure"]) == ("area scale", None)


@pytest.mark.slow
def test_twenty_drawn_valves_contradict_nothing():
    """Sizes of small to large actuators, all data right within the ±10 % of a catalogue."""
    random = np.random.default_rng(26)
    compared = 0
    for _ in range(20):
        area, travel = (
            math.exp(random.uniform(*map(math.log, ends)))
            for ends in ((0.004, 0.12), (0.008, 0.08))
        )
        low, width = random.uniform(2e4, 1e5), random.uniform(5e4, 2e5)
        spring, friction = area * width / travel, area * width * random.uniform(0.01, 0.1)
        mass = 40.0 * area
        packing = vf.KarnoppParameters(
            mass, 2.0 * math.sqrt(spring * mass), friction, 1.2 * friction, spring, area * low
        )
        valve = vf.Valve(diaphragm_area=area, travel=travel)
        time = np.arange(4000) / 100
        pressure = low + width * (0.5 + 0.4 * np.sin(2 * np.pi * time / random.uniform(8, 13)))
        stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
        noise = vf.SensorNoise(3e-4 * travel, 3e-4 * width, seed=int(random.integers(2**31)))
        record = noise.applied_to(vf.Recording(0.01, pressure, stem.position))
        names = ("spring_constant", "spring_preload", "mass")
        stated = {name: getattr(packing, name) * random.uniform(0.9, 1.1) for name in names}
        result = vf.identify(record, valve, vf.IdentificationSettings(stated=stated))
        assert told(result) == {}
        spring_found = result.parameters["spring_constant"]
        compared += spring_found.half_width < 0.1 * spring_found.value
    assert compared == 20


def estimates(spring=SPRING, preload=PRELOAD, mass=1.6, share=0.01):
    values = {"spring_constant": spring, "spring_preload": preload, "mass": mass}
    return {
        name: Parameter(name, value, 0.5 * share * abs(value), share * abs(value), Verdict.WEAK)
        for name, value in values.items()
    }


def causes(parameters, stated):
    return {one.name: one.cause for one in contradictions(parameters, stated, VALVE, 0.028575)}


class TestRules:
    @pytest.mark.parametrize("factor", [0.86, 1.0, 1.149])
    def test_up_to_15_percent_agree(self, factor):
        assert causes(estimates(factor * SPRING), {"spring_constant": SPRING}) == {}

    @pytest.mark.parametrize(
        ("factor", "cause"),
        [
            (0.84, Cause.OTHER_SPRING),
            (1.16, Cause.OTHER_SPRING),
            (1.5, Cause.OTHER_SPRING),
            (3.0, Cause.OTHER_SPRING),
            *((1 / 2.1, Cause.AREA_SCALE), (1.9, Cause.AREA_SCALE), (4.0, Cause.AREA_SCALE)),
            *((6.4516, Cause.AREA_SCALE), (1 / 10.0, Cause.AREA_SCALE)),
            *((100.0, Cause.AREA_SCALE), (1e4, Cause.AREA_SCALE)),
        ],
    )
    def test_the_factor_names_the_cause(self, factor, cause):
        stated = {"spring_constant": SPRING}
        (one,) = contradictions(estimates(factor * SPRING), stated, VALVE, 0.028575)
        assert one == Contradiction(
            "spring_constant", SPRING, factor * SPRING, cause, one.factor, one.pressure
        )
        assert one.factor == pytest.approx(factor, rel=1e-15)

    def test_twice_the_interval_is_left(self):
        """9 % either side: 1.2 times lies beyond 15 %, and within 18 % of the found value."""
        stated = {"spring_constant": SPRING}
        assert causes(estimates(1.2 * SPRING, share=0.09), stated) == {}
        assert causes(estimates(1.2 * SPRING, share=0.08), stated) != {}

    @pytest.mark.parametrize(
        "one",
        [
            fixed("spring_constant", 1e6),
            not_identifiable("spring_constant", "not seen"),
            Parameter("spring_constant", 1e6, math.nan, math.nan, Verdict.WEAK),
            with_verdict("spring_constant", -1e6, 1e3, 2e3),
            estimates(9 * SPRING, share=0.1)["spring_constant"],
        ],
        ids=["given", "withheld", "without an interval", "negative", "wide"],
    )
    def test_what_is_not_compared(self, one):
        assert causes({"spring_constant": one}, {"spring_constant": SPRING}) == {}
        assert causes(estimates(), {"spring_constant": 0.0}) == {}  # a machine without a spring

    @pytest.mark.parametrize("factor", [0.5, 1.4, 2.0])
    def test_the_preload_tells_the_area_from_the_spring(self, factor):
        """Preload 4000 N: 1.4 times is 1600 N more, beyond 15 % of the spring's 5856·1.4 N."""
        stated = {"spring_constant": SPRING, "spring_preload": 4000.0}
        both = estimates(factor * SPRING, factor * 4000.0)
        assert causes(both, stated) == {"spring_constant": Cause.AREA_SCALE}
        spring_only = estimates(factor * SPRING, 4000.0)
        assert causes(spring_only, stated) == {"spring_constant": Cause.OTHER_SPRING}

    def test_area_and_zero_of_pressure_at_once(self):
        stated = {"spring_constant": SPRING, "spring_preload": PRELOAD}
        valve = replace(VALVE, diaphragm_area=2 * TYPED_AREA)
        preload = 2 * (PRELOAD + ATMOSPHERE * TYPED_AREA)
        told = contradictions(estimates(2 * SPRING, preload), stated, valve, 0.028575)
        assert [one.cause for one in told] == [Cause.AREA_SCALE, Cause.ZERO_OF_PRESSURE]
        assert told[1].pressure == pytest.approx(ATMOSPHERE, rel=1e-12)

    @pytest.mark.parametrize("air", [0.92, 1.08])
    def test_the_air_of_another_altitude(self, air):
        parameters = estimates(preload=PRELOAD + air * ATMOSPHERE * TYPED_AREA)
        assert causes(parameters, STATED) == {"spring_preload": Cause.ZERO_OF_PRESSURE}

    @pytest.mark.parametrize("pressure", [5e4, 1.5e5, -5e4, -ATMOSPHERE])
    def test_another_preload(self, pressure):
        """Also a whole atmosphere too little, where the reference is that of gauge pressure."""
        parameters = estimates(preload=PRELOAD + pressure * TYPED_AREA)
        (one,) = contradictions(parameters, STATED, VALVE, 0.028575)
        assert one.cause is Cause.OTHER_PRELOAD
        assert one.pressure == pytest.approx(pressure, rel=1e-12)
        (one,) = contradictions(parameters, STATED, vf.Valve(travel=0.028575), 0.028575)
        assert one.cause is Cause.OTHER_PRELOAD  # of a force, which has no zero of pressure
        assert math.isnan(one.pressure)

    def test_a_mass(self):
        assert causes(estimates(mass=1.8), {"mass": 1.6}) == {}
        assert causes(estimates(mass=3.2), {"mass": 1.6}) == {"mass": Cause.OTHER_MASS}


class TestSettings:
    def test_they_are_frozen_numbers_and_none_that_is_fixed(self):
        settings = vf.IdentificationSettings(fixed={"mass": 1.6}, stated={"mass": 9.0, **STATED})
        assert settings.stated == STATED
        with pytest.raises(TypeError):
            settings.stated["mass"] = 2.0

    @pytest.mark.parametrize(
        ("stated", "words"),
        [
            (
                {"coulomb_friction": 100.0},
                "'coulomb_friction' is not a parameter that can be stated: choose from "
                "spring_constant, spring_preload, mass",
            ),
            ({"mass": 0.0}, "mass must be"),
            ({"spring_constant": -1.0}, "spring_constant must not be negative"),
            ({"spring_preload": math.nan}, "spring_preload must be"),
        ],
    )
    def test_impossible(self, stated, words):
        with pytest.raises(ValueError, match=f"^{words}"):
            vf.IdentificationSettings(stated=stated)


class TestAssumed:
    """What nobody has stated of the valve."""

    def found(self, record, *assumed, stated=None, method="plant"):
        return identified(record, stated or {}, method, assumed)

    @pytest.mark.parametrize("method", ["plant", "published"])
    def test_newtons_of_an_assumed_area_are_weak_and_their_ratios_are_not(self, record, method):
        known, result = (
            self.found(record, *names, method=method)
            for names in ((), ("travel", "diaphragm_area"))
        )
        for name in FORCES:
            one, before = result.parameters[name], known.parameters[name]
            if before.verdict in (Verdict.IDENTIFIED, Verdict.WEAK):
                assert one.verdict is Verdict.WEAK
                assert one.reason.endswith("it depends on an assumed area")
            assert repr(one.without_calibration) == repr(before.without_calibration)
        assert result.warnings == (
            "not stated, and assumed: travel 0.028575 m, diaphragm_area 0.0445 m²; values in "
            "newtons depend on an assumed area; percentages and ratios do not; percentages of the "
            "travel depend on an assumed travel",
            *known.warnings,
        )
        assert result.to_dict()["settings"]["assumed"] == ["travel", "diaphragm_area"]

    def test_a_stated_spring_that_the_record_confirms_makes_up_for_an_area(self, record):
        result = self.found(record, "diaphragm_area", stated={"spring_constant": SPRING})
        assert verdicts(result) == verdicts(self.found(record))
        assert result.warnings[0] == "not stated, and assumed: diaphragm_area 0.0445 m²"

    def test_of_an_assumed_reference_the_preload_alone_is_weak(self, record):
        known, result = self.found(record), self.found(record, "pressure_reference")
        assert known.parameters["spring_preload"].verdict is Verdict.IDENTIFIED
        changed = {n for n in FORCES if result.parameters[n] != known.parameters[n]}
        changed -= {n for n in FORCES if math.isnan(known.parameters[n].value)}
        assert changed == {"spring_preload"}
        assert (
            result.parameters["spring_preload"].reason
            == "it depends on an assumed pressure_reference"
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

    def test_pressure_in_percent_or_pascals_that_were_read_as_another_unit(self):
        assert "% read as Pa?" in refusal(*strokes(0.0, 100.0))
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

    def test_position_in_percent_or_without_a_travel(self):
        recording, valve = strokes(0.4e5, 2e5, 0.028)
        share = 100 * recording.position / 0.028
        with pytest.raises(RefusalError, match="%"):
            identify(Recording(0.02, recording.drive, share), valve)
        recording, valve = strokes(0.4e5, 2e5)
        wrong = Recording(0.02, recording.drive, recording.position * 1e3)
        assert "mm" in refusal(wrong, valve).split(": ")[1]

    @pytest.mark.parametrize("area", AREAS)
    @pytest.mark.parametrize("unit", SQUARE_METRES)
    def test_area(self, unit, area):
        with pytest.raises(ValueError, match="diaphragm_area") as caught:
            require_valve_units(Valve(area / SQUARE_METRES[unit]), {})
        assert f"{unit} " in str(caught.value).split(": ")[1]

    @pytest.mark.parametrize("unit", ["mm", "cm"])
    def test_travel(self, unit):
        for travel in (one / METRES[unit] for one in TRAVELS):
            if travel >= 0.7:  # a long piston has less
                with pytest.raises(ValueError, match=f"^travel .*: .*{unit} "):
                    require_valve_units(Valve(0.0445, travel=travel), {})

    def test_pressure_reference_and_spring_constant(self):
        for value in (1.01325, 101.325, 14.696, 1013.25):
            with pytest.raises(ValueError, match=r"pressure_reference .*(bar|kPa|psi|mbar)"):
                require_valve_units(Valve(0.0445, pressure_reference=value), {})
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

    def test_the_unit_of_a_date_is_known(self):
        slow = replace(self.bench(1e3), start_time=1.8e9)
        require_plausible_units(slow, BENCH_VALVE, DEFAULTS)

    def test_a_record_too_short_in_ms_is_in_seconds(self):
        """80 minutes of a slow stem that seems to lag by minutes would be 4.8 s in ms."""
        time = np.arange(0.0, 4800.0)
        pressure = 1e5 + 3e4 * np.sin(2 * np.pi * time / 1200.0)
        late = 0.01 + 0.005 * np.sin(2 * np.pi * time / 1200.0 - 0.5)
        for times, is_asked in ((1.0, False), (1.1, True)):
            recording = Recording(times, pressure, late)
            if is_asked:
                assert "ms read as s?" in refusal(recording, BENCH_VALVE)
            else:
                require_plausible_units(recording, BENCH_VALVE, DEFAULTS)

    @pytest.mark.parametrize("seed", range(3))
    def test_a_slow_loop_does_not_lag(self, seed):
        """Noise in the speed of slow moves is no viscous friction."""
        rng = np.random.default_rng(seed)
        time = np.arange(0.0, 6 * 3600.0, 0.1)
        angle = 2 * np.pi * time / rng.uniform(300, 3000)
        pressure = 130e3 + rng.uniform(15e3, 55e3) * np.sin(angle)
        stem = simulate(BENCH_VALVE, LOW_FRICTION, pressure, sample_period=0.1).position[::10]
        noise = rng.standard_normal((2, stem.size))
        record = Recording(
            1.0,
            pressure[::10] + rng.uniform(20, 300) * noise[0],
            stem + rng.uniform(2e-6, 5e-5) * noise[1],
        )
        require_plausible_units(record, BENCH_VALVE, DEFAULTS)

    def test_too_fast(self):
        assert "s read as ms" in refusal(self.bench(1e-3), BENCH_VALVE)
        (remark,) = time_remarks(self.bench(1 / 60), BENCH_VALVE)
        assert "min read as s" in remark

    @pytest.mark.parametrize("method", ["plant", "bench", "published"])
    def test_every_method_refuses(self, method):
        with pytest.raises(RefusalError, match="ms read as s"):
            identify(self.bench(1e3), BENCH_VALVE, method=method)
