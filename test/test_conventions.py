# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Signs and units of doc/conventions.md, with expectations derived from the force balance itself.

m·ẍ = S_a·(P − P_ref) − k·x − F_0 − friction, on a valve with round numbers.
"""

import ast
import math
import re
from collections import defaultdict
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import valve_friction_ros as vf
from valve_friction_ros.health import Baseline, DatedNumber, diagnose
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.history import MONTH, trend_of
from valve_friction_ros.identification import (
    IMPERFECTIONS_FOUND,
    PARAMETER_UNITS,
    Result,
    StemComparison,
    identify_plant,
    step_test,
    validate,
)
from valve_friction_ros.identification.trust.verdict import with_verdict
from valve_friction_ros.model import (
    KarnoppParameters,
    Recording,
    StemState,
    Valve,
    advance,
    balanced_state,
    simulate,
)

PAGE = (Path(__file__).resolve().parents[1] / "doc" / "conventions.md").read_text(encoding="utf-8")

TESTS = Path(__file__).resolve().parent

AREA, REFERENCE = 0.05, 1e5
VALVE = Valve(diaphragm_area=AREA, pressure_reference=REFERENCE, travel=0.04)
STIFFNESS, PRELOAD, COULOMB, STATIC, VISCOUS = 1e5, 500.0, 100.0, 150.0, 2e3
PACKING = KarnoppParameters(
    mass=2.0,
    viscous_friction=VISCOUS,
    coulomb_friction=COULOMB,
    static_friction=STATIC,
    spring_constant=STIFFNESS,
    spring_preload=PRELOAD,
)
MIDDLE = 0.02


def pressure_of(force):
    return REFERENCE + force / AREA


BALANCE = PRELOAD + STIFFNESS * MIDDLE
"""Actuator force, N, that balances spring and preload at the middle of the travel."""


def after(force, velocity=0.0, duration=1e-6, packing=PACKING):
    """State of a stem from the middle of the travel, after a time under a constant force, N."""
    pressure = pressure_of(force)
    start = StemState(MIDDLE, velocity)
    return advance(start, VALVE, packing, (pressure, pressure), duration)


class TestForceBalance:
    def test_pressure_above_the_reference_pushes_the_stem_up(self):
        assert VALVE.actuator_force(np.array([REFERENCE + 1e4]))[0] == pytest.approx(500.0)
        assert after(BALANCE + STATIC + 50.0, duration=0.1).position > MIDDLE
        assert after(BALANCE - STATIC - 50.0, duration=0.1).position < MIDDLE

    def test_the_preload_acts_like_a_spring_that_is_compressed_at_zero(self):
        """Without friction the stem rests at (F − F_0)/k."""
        assert balanced_state(VALVE, PACKING, pressure_of(1500.0)).position == pytest.approx(0.01)

    def test_the_stem_stays_between_its_stops(self):
        assert balanced_state(VALVE, PACKING, pressure_of(-1e4)).position == 0.0
        assert balanced_state(VALVE, PACKING, pressure_of(1e5)).position == VALVE.travel

    @pytest.mark.parametrize("way", [1.0, -1.0])
    def test_friction_opposes_the_velocity(self, way):
        """In balance only friction acts: m·ẍ = −(F_c + F_v·|ẋ|)·sgn ẋ."""
        speed, time = 0.05, 1e-6
        lost = (COULOMB + VISCOUS * speed) / PACKING.mass * time
        changed = after(BALANCE, way * speed, time).velocity
        assert way * (changed - way * speed) == pytest.approx(-lost, rel=1e-3)
        assert np.sign(PACKING.sliding_friction(np.array([way * speed]))[0]) == way

    @pytest.mark.parametrize("pull", [STATIC - 1.0, -STATIC + 1.0])
    def test_a_resting_stem_is_held_up_to_the_static_friction(self, pull):
        assert after(BALANCE + pull, duration=1.0) == StemState(MIDDLE, 0.0)

    def test_positive_asymmetry_is_more_friction_upwards(self):
        uneven = replace(PACKING, coulomb_asymmetry=0.2, viscous_asymmetry=0.1)
        up, down = np.abs(uneven.sliding_friction(np.array([0.05, -0.05])))
        assert up == pytest.approx(COULOMB * 1.2 + VISCOUS * 0.05 * 1.1)
        assert down == pytest.approx(COULOMB * 0.8 + VISCOUS * 0.05 * 0.9)


PERIOD = 0.01
TIME = PERIOD * np.arange(4000)
PRESSURE = pressure_of(BALANCE + 1200.0 * np.sin(2 * np.pi * TIME / 8))


@pytest.fixture(scope="module")
def stem():
    return simulate(VALVE, replace(PACKING, static_friction=COULOMB), PRESSURE, PERIOD).position


class TestRecords:
    def test_lag_is_positive_where_the_stem_is_stamped_late(self, stem):
        """A late stamp t + 0.1 s: the position of sample n appears at sample n + 10."""
        late = Recording(PERIOD, PRESSURE[10:], stem[:-10])
        early = Recording(PERIOD, PRESSURE[:-10], stem[10:])
        offsets = [
            identify_plant(record, VALVE).evidence[IMPERFECTIONS_FOUND]["lag"]["value"]
            for record in (late, early)
        ]
        assert offsets[0] == pytest.approx(0.1, abs=0.03)
        assert offsets[1] == pytest.approx(-0.1, abs=0.03)

    def test_residual_is_simulated_minus_measured(self, stem):
        above = Recording(PERIOD, PRESSURE, stem + 1e-3)
        packing = replace(PACKING, static_friction=COULOMB)
        assert validate(above, VALVE, packing).residual[-1000:].mean() < -0.5e-3
        comparison = StemComparison(PERIOD, measured=stem + 1e-3, simulated=stem)
        assert comparison.residual == pytest.approx(-1e-3)

    def test_a_step_up_has_a_positive_change(self):
        command = np.where(np.arange(200) < 100, 0.2, 0.5)
        (step,) = step_test(command, 2 * command, 0.1).steps
        assert step.input_change == pytest.approx(0.3)
        assert step.output_change == pytest.approx(0.6)


class TestHealth:
    @pytest.mark.parametrize(("friction", "ratio"), [(200.0, 2.0), (50.0, 0.5)])
    def test_ratio_is_friction_now_over_baseline(self, stem, friction, ratio):
        result = vf.identify(Recording(PERIOD, PRESSURE, stem), VALVE)
        changed = with_verdict("coulomb_friction", friction, 0.5, 1.0)
        now: Result = replace(result, parameters={**result.parameters, "coulomb_friction": changed})
        found = diagnose(now, VALVE, Baseline(100.0, 1.0)).ratio
        assert found is not None
        assert found.value == pytest.approx(ratio)

    def test_drift_is_positive_where_friction_grows(self):
        day = 86_400 * 10**9
        points = [DatedNumber(k * day, 100.0 + k, 0.5) for k in range(10)]
        trend = trend_of(points)
        assert trend is not None
        assert trend.drift == pytest.approx(MONTH / day, rel=0.01)


SI = {"kg", "N", "m", "s", "1", "Pa"}


TABLE = dict(re.findall(r"^\| `(\w+)` \| [^|]+ \| (\S+) \|$", PAGE, flags=re.MULTILINE))


class TestUnits:
    def test_the_table_is_that_of_the_results(self):
        assert dict(PARAMETER_UNITS) == TABLE

    def test_every_parameter_of_the_model_has_a_unit(self):
        known = {one.name for one in fields(KarnoppParameters)} - {"limit_velocity"}
        assert known <= set(TABLE)

    @pytest.mark.parametrize("name", sorted(PARAMETER_UNITS))
    def test_units_are_si(self, name):
        """Products and quotients of base units, and N: no prefix, no percent."""
        assert set(re.split(r"[·/]", TABLE[name])) <= SI


def test_no_two_modules_of_tests_have_one_name():
    """Two of one name in different rooms cannot be collected in one run."""
    names = [path.name for path in TESTS.rglob("*.py") if path.name != "conftest.py"]
    assert sorted(names) == sorted(set(names))


def public_types():
    """Names of the public classes of the package, with the files that declare each."""
    sources = Path(vf.__file__).resolve().parent
    found = defaultdict(list)
    for path in sorted(sources.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(path.relative_to(sources).as_posix())
    return found


def test_a_public_type_has_a_name_of_its_own():
    types = public_types()
    assert len(types) > 100
    assert not {name: paths for name, paths in types.items() if len(paths) > 1}


def test_no_function_is_longer_than_a_screen():
    most = 80
    long = [
        f"{path.name}: {node.name} has {size} lines"
        for path in Path(vf.__file__).resolve().parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (size := (node.end_lineno or 0) - node.lineno + 1) > most
    ]
    assert not long


def test_a_type_with_a_number_that_may_be_nan_is_equal_by_its_fields():
    """Since Python 3.13 two equal dataclasses with a nan would differ."""
    sources, wrong, checked = Path(vf.__file__).resolve().parent, [], 0
    for path in sorted(sources.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                rules = [ast.unparse(one) for one in node.decorator_list]
                values = [ast.unparse(one) for one in node.body if isinstance(one, ast.AnnAssign)]
                is_compared = any("frozen" in one and "eq=False" not in one for one in rules)
                if is_compared and any(one.endswith("= math.nan") for one in values):
                    checked += 1
                    wrong += [node.name] if "equal_by_fields" not in rules else []
    assert checked > 5
    assert not wrong


def test_equality_by_fields():
    number = Measured(math.nan, low=1.0)
    assert number == replace(number)
    assert hash(number) == hash(replace(number))
    assert number != replace(number, low=2.0)
    assert number != "a number"


def test_the_types_of_the_page_are_there():
    named = re.findall(r"^\| `([A-Z]\w+)` \|", PAGE, re.MULTILINE)
    assert len(named) > 8
    assert not set(named) - set(public_types())


def test_only_one_module_rounds_a_number_to_its_interval():
    """Half a width with digits of its own (``± {width:.2f}``) may show more than is known."""
    sources = Path(vf.__file__).resolve().parent
    others = [path for path in sources.rglob("*.py") if path.name != "wording.py"]
    assert len(others) > 100
    found = []
    for path in others:
        for text in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            parts = text.values if isinstance(text, ast.JoinedStr) else []
            for before, after in pairwise(parts):
                is_width = isinstance(before, ast.Constant) and before.value.endswith(("±", "± "))
                if is_width and isinstance(after, ast.FormattedValue) and after.format_spec:
                    found.append(f"{path.relative_to(sources)}:{text.lineno}")
    assert not found
