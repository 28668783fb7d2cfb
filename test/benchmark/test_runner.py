"""Whatever an identification does, each case has an outcome."""

from dataclasses import replace

from benchmark.reality.excitations import DEVELOPMENT, Kind
from benchmark.reality.runner import run
from benchmark.reality.suite import cases


def test_each_case_has_its_outcome():
    excitation = replace(DEVELOPMENT[Kind.RANDOM], duration=2.0, before=0.5)
    ideal = cases(seeds=1, classes=("ideal",), drives=(Kind.RANDOM,))
    low = next(case for case in ideal if case.growth == 1.0 and case.packing == "low")
    grown = next(case for case in ideal if case.growth > 1.0 and case.packing == "low")
    suite = [
        replace(low, imperfection="odd", label=label, excitation=excitation)
        for label in ("", "small", "large", "fine", "huge", "last")
    ]
    suite.append(replace(grown, excitation=excitation))
    outcomes = {one.name: one for one in run(suite, "odd_identification", 2, limit=1.0)}
    assert outcomes.keys() == {case.name for case in suite}
    by_label = {one.label: one for one in outcomes.values() if one.imperfection == "odd"}
    assert by_label["small"].failure == "RuntimeError: odd"
    assert by_label["large"].failure == "TimeoutError: more than 1 s of the processor"
    assert by_label["huge"].failure == "the process died"
    for label in ("", "fine", "last"):
        assert not by_label[label].failure
        assert by_label[label].numbers["coulomb_friction"].verdict == "identified"
        assert by_label[label].alarm == ""
    assert outcomes[suite[-1].name].alarm == "high"
