"""An identification that answers, fails, hangs or dies, as the label of the case asks."""

import os

from benchmark.reality.answers import Answer, Number


def identify(record):
    label = record.case.label
    if "small" in label:
        raise RuntimeError("odd")
    while "large" in label:
        pass
    if "huge" in label:
        os._exit(1)
    number = Number(record.truth.coulomb_friction.value, 1.0, "identified")
    return Answer({"coulomb_friction": number}, (), native=number)


def alarm(record, answer, baseline):
    grown = answer.native.value > 1.2 * baseline.native.value
    return "high" if grown and record.position.values.size else ""
