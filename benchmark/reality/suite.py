"""All cases: imperfection × packing × drive × seed, and the same with friction that has grown."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from benchmark.reality.excitations import DEVELOPMENT, HELD_OUT, REACH, Excitation, Kind
from benchmark.reality.imperfections import DRIVES, Imperfection
from benchmark.reality.plant_imperfections import plant_imperfections
from benchmark.reality.plants import PACKINGS, Plant
from benchmark.reality.records import Case
from benchmark.reality.time_imperfections import time_imperfections

__all__ = ["GROWTH", "cases", "imperfections", "packings"]

GROWTH = 1.5
"""Friction of a valve whose packing was tightened, over that of its baseline."""

_FIRST_HELD_OUT_SEED = 50_000


def imperfections(held_out: bool = False) -> Iterator[Imperfection]:
    """Yield all imperfections, the ideal first."""
    yield Imperfection("ideal", "", drives=(*DRIVES, Kind.HUNTING))
    yield from time_imperfections(held_out)
    yield from plant_imperfections(held_out)


def _elsewhere(plant: Plant, friction: float, viscous: float, spring: float) -> Plant:
    """Return a plant whose numbers differ by these factors."""
    return Plant(
        replace(plant.body, spring=plant.body.spring * spring),
        replace(
            plant.friction,
            coulomb=plant.friction.coulomb * friction,
            static=plant.friction.static * friction,
            viscous=plant.friction.viscous * viscous,
        ),
    )


def packings(held_out: bool = False) -> Mapping[str, Plant]:
    """Return the three packings; those held out differ in their numbers."""
    if not held_out:
        return PACKINGS
    return {
        "low": _elsewhere(PACKINGS["low"], 1.25, 1.6, 0.94),
        "high": _elsewhere(PACKINGS["high"], 0.85, 0.7, 1.05),
        "graphite": _elsewhere(PACKINGS["graphite"], 0.9, 0.6, 1.03),
    }


def _drive(drives: Mapping[Kind, Excitation], kind: Kind, imperfection: Imperfection) -> Excitation:
    chosen = drives[kind]
    if imperfection.reaches_stops:
        low, high = REACH if kind is not Kind.SERVICE else (0.0, 1.0)
        chosen = replace(chosen, low=low, high=high)
    return chosen


def _case(
    imperfection: Imperfection,
    packing: str,
    plant: Plant,
    excitation: Excitation,
    seed: int,
) -> Case:
    changed = imperfection.change(plant)
    return Case(
        imperfection.kind,
        imperfection.label,
        packing,
        changed,
        imperfection.instruments,
        excitation,
        seed,
        imperfection.words,
        changed if imperfection.is_another_plant else plant,
    )


def cases(
    seeds: int = 5,
    held_out: bool = False,
    classes: Collection[str] = (),
    drives: Collection[Kind] = (),
    grown: bool = True,
    brief: bool = False,
) -> list[Case]:
    """Enumerate the suite.

    Parameters
    ----------
    seeds : int
        Records of each combination.
    held_out : bool
        Take the magnitudes, packings, drives and seeds that nothing was developed with.
    classes : collection of str
        Only these classes of imperfections; all if empty.
    drives : collection of Kind
        Only these drives; all if empty.
    grown : bool
        Add to each case of random levels the same with friction `GROWTH` times as large.
    brief : bool
        Of each class only one imperfection, of a middle size.

    Returns
    -------
    list of Case
        In an order in which one motion serves the following cases as well.

    Raises
    ------
    ValueError
        If there is no such class.
    """
    every = list(imperfections(held_out))
    unknown = set(classes) - {one.kind for one in every}
    if unknown:
        known = ", ".join(dict.fromkeys(one.kind for one in every))
        raise ValueError(f"unknown classes {', '.join(sorted(unknown))}; known are {known}")
    if brief:
        every = _one_each(every)
    signals = HELD_OUT if held_out else DEVELOPMENT
    first = _FIRST_HELD_OUT_SEED if held_out else 0
    found = [
        _case(one, packing, plant, _drive(signals, kind, one), seed)
        for seed in range(first, first + seeds)
        for packing, plant in packings(held_out).items()
        for kind in Kind
        for one in every
        if kind in one.drives
        and (not classes or one.kind in classes)
        and (not drives or kind in drives)
    ]
    if grown:
        found += [_grown(case) for case in found if case.excitation.kind is Kind.RANDOM]
    places = {case: place for place, case in enumerate(found)}
    motions: dict[tuple[Plant, Excitation, int], int] = {}
    for place, case in enumerate(found):
        motions.setdefault((case.plant, case.excitation, case.seed), place)
    return sorted(
        found,
        key=lambda case: (motions[case.plant, case.excitation, case.seed], places[case]),
    )


def _one_each(every: Sequence[Imperfection]) -> list[Imperfection]:
    """Return the middle one of each class."""
    kinds = dict.fromkeys(one.kind for one in every)
    classes = [[one for one in every if one.kind == kind] for kind in kinds]
    return [members[len(members) // 2] for members in classes]


def _grown(case: Case) -> Case:
    plant = Plant(case.plant.body, case.plant.friction.scaled(GROWTH))
    return replace(case, plant=plant, growth=GROWTH)
