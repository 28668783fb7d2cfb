"""The diagnosis of a valve in one sentence, for those who plan its maintenance."""

import math
from typing import NamedTuple

from valve_friction_ros.health import FrictionState, dead_band, drive_scale, percentage
from valve_friction_ros.identification import SLIDING, Parameter, Verdict, two_digits
from valve_friction_ros.reports.identified_record import IdentifiedRecord

__all__ = ["diagnosis_sentence"]


class _Finding(NamedTuple):
    what: str
    advice: str


_AGAIN = "before any work, identify it again from a longer record with more strokes"
_CHECK = "check the sensors and their mounting, then identify it again"

_ALARMS = {
    FrictionState.EXCESS: _Finding(
        "the friction is excessive, {ratio}",
        "plan work on the packing now, and expect the loop to oscillate until then",
    ),
    FrictionState.COLLAPSED: _Finding(
        "the friction has collapsed, {ratio}", "check the packing for leakage now"
    ),
    FrictionState.GROWN: _Finding(
        "the friction has grown, {ratio}", "plan work on the packing for the next stop"
    ),
    FrictionState.FALLEN: _Finding(
        "the friction has fallen, {ratio}", "look at the packing at the next stop: it may be worn"
    ),
    FrictionState.UNCLEAR: _Finding("the friction cannot be told from before, {ratio}", _AGAIN),
    FrictionState.PERHAPS_GROWN: _Finding("the friction has perhaps grown, {ratio}", _AGAIN),
    FrictionState.PERHAPS_FALLEN: _Finding("the friction has perhaps fallen, {ratio}", _AGAIN),
}


def diagnosis_sentence(record: IdentifiedRecord) -> str:
    """Return one sentence: finding, certainty, consequence and advice.

    What else has changed on the valve follows, one sentence each. It states the diagnosis of the
    monitor in words for readers outside control engineering.
    """
    friction = _friction(record)
    alarm = _ALARMS.get(record.diagnosis.state)
    if record.diagnosis.ratio is None and alarm is not None:
        vanished = next(one for one in _frictions(record) if math.isnan(one.value))
        size = f"at most {vanished.magnitude_bound:.2g} N, too small to be identified"
        finding = _Finding(alarm.what.format(ratio=size), alarm.advice)
    elif math.isnan(friction.value):
        finding = _Finding(
            f"this record does not determine the friction ({friction.reason})",
            "move the valve through several fast strokes in both directions and identify it again",
        )
    elif friction.value < 0:
        finding = _Finding(
            f"the identified friction is {friction.value:.4g} N, and friction is above zero",
            "check the direction of both signals and identify it again",
        )
    else:
        finding = _found(record)
    doubt = _doubt(record)
    told = f"{doubt}{finding.what}{_consequence(record)}: {finding.advice}"
    sentences = (told, *(one.message for one in record.findings))
    return " ".join(f"{one[0].upper()}{one[1:]}." for one in sentences)


def _frictions(record: IdentifiedRecord) -> list[Parameter]:
    parameters = record.result.parameters
    return [parameters[name] for name in ("coulomb_friction", SLIDING) if name in parameters]


def _friction(record: IdentifiedRecord) -> Parameter:
    """Return the friction that was compared; without a comparison one that is known, F_c if it is.

    One below zero comes first: it is a fault of the signals.
    """
    ratio, frictions = record.diagnosis.ratio, _frictions(record)
    if ratio is not None:
        return record.result.parameters[ratio.of]
    below = [one for one in frictions if one.value < 0]
    known = [one for one in frictions if not math.isnan(one.value)]
    return [*below, *known, *frictions][0]


def _found(record: IdentifiedRecord) -> _Finding:
    friction, diagnosis = _friction(record), record.diagnosis
    if diagnosis.ratio is None:
        size = f"{friction.value:.4g}"
        if friction.verdict is not Verdict.FIXED:
            size += f" ± {two_digits(friction.half_width)}"
        advice = "set a baseline, the friction of the healthy valve"
        if record.baseline is not None:
            advice = "move the valve as its baseline was taken, and identify it again"
        return _Finding(
            f"the friction is {size} N{_sureness(friction)}",
            f"to find out whether it has grown, {advice}",
        )
    ratio = (
        f"{diagnosis.ratio.value:.2f} times that of the healthy valve (95 % interval: "
        f"{diagnosis.ratio.low:.2f} to {diagnosis.ratio.high:.2f}){_sureness(friction)}"
    )
    if record.is_scaled:
        advice = (
            f"before any work on the packing, check {drive_scale(record.valve)}, as the spring "
            "constant has changed by the same factor"
        )
        return _Finding(f"the friction seems to have changed, {ratio}", advice)
    if diagnosis.state in _ALARMS:
        alarm = _ALARMS[diagnosis.state]
        return _Finding(alarm.what.format(ratio=ratio), alarm.advice)
    advice = _CHECK if _doubt(record) else "no action is needed"
    return _Finding(f"the friction is normal, {ratio}", advice)


def _sureness(friction: Parameter) -> str:
    """Return the limitation of the number, or an empty string if it is identified."""
    words = {
        Verdict.IDENTIFIED: "",
        Verdict.WEAK: f", with the verdict weak ({friction.reason})",
        Verdict.FIXED: ", which was given and not identified",
    }
    return words[friction.verdict]


def _doubt(record: IdentifiedRecord) -> str:
    misfit = record.result.misfit
    if misfit is None or misfit.describes:
        return ""
    explained = "force" if math.isnan(misfit.of_stem) else "stem's motion"
    return (
        "use this with caution, because the model does not describe this valve "
        f"({misfit.words} of the {explained} remain unexplained): "
    )


def _consequence(record: IdentifiedRecord) -> str:
    share = dead_band(record.result, record.valve)
    if math.isnan(share) or share < 0:
        return ""
    return f", and the stem ignores reversals smaller than {percentage(share)} of its travel"
