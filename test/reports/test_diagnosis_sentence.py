"""The verdict in one sentence: what, how sure, what follows, what to do."""

import dataclasses
import math

import pytest

from valve_friction_ros.health import Baseline, FrictionLimits, Level
from valve_friction_ros.identification import Verdict
from valve_friction_ros.reports import diagnosis_sentence

BASELINE = Baseline(100.0)
NAN = float("nan")
# 2 F_c/k = F_c · 1e-5 m of 28.575 mm: 0.035 % for each newton.


def ratio_told(value, share):
    """The ratio with the interval of a relative half width of `share`, as the sentence has it."""
    low, high = value * math.exp(-share), value * math.exp(share)
    return f"{value:.2f} times that of the healthy valve (95 % interval: {low:.2f} to {high:.2f})"


@pytest.mark.parametrize(
    ("friction", "half_width", "begin", "effect", "advice"),
    [
        (
            400.0,
            4.0,
            f"The friction is excessive, {ratio_told(4.0, 0.01)}",
            "14 %",
            "plan work on the packing now, and expect the loop to oscillate until then",
        ),
        (
            150.0,
            3.0,
            f"The friction has grown, {ratio_told(1.5, 0.02)}",
            "5.2 %",
            "plan work on the packing for the next stop",
        ),
        (
            30.0,
            0.3,
            f"The friction has collapsed, {ratio_told(0.3, 0.01)}",
            "1 %",
            "check the packing for leakage now",
        ),
        (
            70.0,
            0.7,
            f"The friction has fallen, {ratio_told(0.7, 0.01)}",
            "2.4 %",
            "look at the packing at the next stop: it may be worn",
        ),
        (
            102.0,
            2.04,
            f"The friction is normal, {ratio_told(1.02, 0.02)}",
            "3.6 %",
            "no action is needed",
        ),
        (
            150.0,
            75.0,
            f"The friction cannot be told from before, {ratio_told(1.5, 0.5)}",
            "5.2 %",
            "before any work, identify it again from a longer record with more strokes",
        ),
        (
            75.0,
            30.0,
            f"The friction cannot be told from before, {ratio_told(0.75, 0.4)}",
            "2.6 %",
            "before any work, identify it again from a longer record with more strokes",
        ),
    ],
)
def test_against_a_baseline(with_friction, friction, half_width, begin, effect, advice):
    record = with_friction(friction, half_width, baseline=BASELINE)
    assert diagnosis_sentence(record) == (
        f"{begin}, and the stem ignores reversals smaller than {effect} of its travel: {advice}."
    )


def test_limits_are_those_of_the_record(with_friction):
    narrow = FrictionLimits(warn_ratio=1.01, error_ratio=1.05)
    record = with_friction(110.0, baseline=BASELINE, limits=narrow)
    assert diagnosis_sentence(record).startswith("The friction is excessive, 1.10 times")


def test_without_a_baseline(with_friction):
    assert diagnosis_sentence(with_friction(152.7, 1.2)) == (
        "The friction is 152.7 ± 1.2 N, and the stem ignores reversals smaller than 5.3 % of its "
        "travel: to find out whether it has grown, set a baseline, the friction of the healthy "
        "valve."
    )


def test_a_weak_or_a_given_number_is_called_so(with_friction):
    weak = with_friction(400.0, 30.0, Verdict.WEAK, "two strokes only", baseline=BASELINE)
    assert ", with the verdict weak (two strokes only), and the stem" in diagnosis_sentence(weak)
    given = with_friction(150.0, 0.0, Verdict.FIXED, "given")
    assert diagnosis_sentence(given).startswith(
        "The friction is 150 N, which was given and not identified, and the stem"
    )


def test_what_is_not_identifiable_has_no_number(with_friction):
    record = with_friction(NAN, NAN, Verdict.NOT_IDENTIFIABLE, "too few strokes", baseline=BASELINE)
    assert diagnosis_sentence(record) == (
        "This record does not determine the friction (too few strokes): move the valve through "
        "several fast strokes in both directions and identify it again."
    )


def test_an_impossible_friction_names_the_signals(with_friction):
    assert diagnosis_sentence(with_friction(-20.0, baseline=BASELINE)) == (
        "The identified friction is -20 N, and friction is above zero: check the direction of both "
        "signals and identify it again."
    )


def test_a_model_that_does_not_describe_the_valve_comes_first(with_friction, identified):
    misfit = dataclasses.replace(identified.result.misfit, systematic=40e-6, tolerated=10e-6)
    doubt = (
        "Use this with caution, because the model does not describe this valve (40 µm of the "
        "stem's motion remain unexplained): the friction "
    )
    normal = with_friction(100.0, baseline=BASELINE, misfit=misfit)
    assert normal.diagnosis.level is Level.OK
    assert diagnosis_sentence(normal).startswith(f"{doubt}is normal, ")
    assert diagnosis_sentence(normal).endswith(
        "check the sensors and their mounting, then identify it again."
    )
    excessive = with_friction(400.0, baseline=BASELINE, misfit=misfit)
    assert diagnosis_sentence(excessive).startswith(f"{doubt}is excessive, ")
