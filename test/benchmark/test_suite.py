"""The suite is what it says: reproducible, complete, and true to its plants."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmark.reality.answers import Number, Outcome
from benchmark.reality.bounds import bounds
from benchmark.reality.counts import judged, tally
from benchmark.reality.excitations import Kind
from benchmark.reality.records import make_record
from benchmark.reality.suite import cases, imperfections
from benchmark.reality.truth import TrueValue


def find(**wanted):
    return cases(seeds=1, grown=False, **wanted)[0]


def test_a_record_is_the_same_each_time():
    case = find(classes=("field",), drives=(Kind.RANDOM,))
    first, again = make_record(case), make_record(case)
    other = make_record(replace(case, seed=case.seed + 1))
    for name in ("pressure", "position"):
        signal, same, different = (getattr(one, name) for one in (first, again, other))
        assert (signal.stamps == same.stamps).all()
        assert (signal.values == same.values).all()
        assert not np.array_equal(signal.values, different.values)


def test_cases_have_names_of_their_own_and_neighbours_share_motions():
    for held_out in (False, True):
        suite = cases(seeds=2, held_out=held_out)
        assert len({case.name for case in suite}) == len(suite)
        motions = [(case.plant, case.excitation, case.seed) for case in suite]
        changes = sum(a != b for a, b in pairwise(motions)) + 1
        assert changes == len(set(motions))


def test_held_out_shares_nothing_with_development():
    def magnitudes(held_out):
        return {(one.kind, one.label) for one in imperfections(held_out) if one.label}

    same = {kind for kind, _ in magnitudes(False) & magnitudes(True)}
    assert same <= {"field"}
    assert {one.kind for one in imperfections(True)} == {one.kind for one in imperfections()}


def test_unknown_class():
    with pytest.raises(ValueError, match="unknown classes gremlins"):
        cases(classes=("gremlins",))


def test_truth_of_an_ideal_record():
    record = make_record(find(classes=("ideal",), drives=(Kind.SQUARE,)))
    truth, plant = record.truth, record.case.plant
    assert truth.coulomb_friction.value == pytest.approx(plant.friction.coulomb)
    assert truth.spring_constant.value == pytest.approx(plant.body.spring)
    assert truth.spring_preload.value == pytest.approx(plant.body.preload)
    assert truth.coulomb_friction.spread < 1e-6
    assert truth.sliding_friction.value > plant.friction.coulomb


def test_truth_leaves_open_what_has_no_single_value():
    record = make_record(find(classes=("along travel",), drives=(Kind.RANDOM,)))
    friction = record.truth.coulomb_friction
    assert friction.value == pytest.approx(152.7, rel=0.03)
    assert 0 < friction.spread < 0.02 * friction.value
    area = make_record(find(classes=("area along travel",), drives=(Kind.RANDOM,)))
    assert area.truth.spring_constant.spread > 0.002 * area.truth.spring_constant.value


def outcome(value, half_width, verdict="identified", **options):
    case = find(classes=("jitter",), drives=(Kind.RANDOM,))
    return replace(
        Outcome(case.name, "jitter", "", "low", "random", 0, 1.0, 62.0, ("jitter",)),
        truth={
            "coulomb_friction": TrueValue(100.0, 1.0),
            "sliding_friction": TrueValue(100.0),
        },
        numbers={
            "coulomb_friction": Number(value, half_width, verdict),
            "sliding_friction": Number(value, half_width, "weak"),
        },
        **options,
    )


@pytest.mark.parametrize(
    ("value", "half_width", "inside", "wrong"),
    [
        (101.5, 0.6, True, False),  # 0.5 beyond what is open
        (104.0, 2.0, False, False),  # outside, within three half widths
        (104.0, 0.5, False, True),
        (102.5, 0.1, False, False),  # off by 1.5 % only
    ],
)
def test_wrong_and_inside(value, half_width, inside, wrong):
    (one,) = judged(outcome(value, half_width))
    assert (one.is_inside, one.is_wrong) == (inside, wrong)


def test_counts():
    ideal = replace(outcome(100.0, 1.0), imperfection="ideal", words=())
    silent = outcome(120.0, 3.0, "weak", sentences=("its interval is ±3 %",))
    named = outcome(104.0, 3.0, "weak", sentences=("±30 % of jitter",), alarm="high")
    grown = outcome(150.0, 1.0, growth=1.5, alarm="high")
    count = tally([silent, named, grown], {("low", "random", 0, 1.0): ideal})
    assert (count.doubted, count.named, count.usable, count.unchanged) == (2, 1, 1, 2)
    assert (count.grown, count.declared, len(count.alarms)) == (1, 1, 1)
    missed = {bound.what for bound in bounds([ideal, silent, named, grown]) if not bound.met}
    assert "alarms of an unchanged valve: none" in missed


def test_outcome_comes_back_from_its_line():
    one = outcome(100.0, float("nan"), sentences=("a",))
    back = Outcome.from_line(one.as_line())
    assert back.as_line() == one.as_line()
    assert back.words == one.words
