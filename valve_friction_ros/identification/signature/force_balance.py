# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Method "signature": the paper's model 2, from the force balances of a valve signature."""

import math
from collections.abc import Mapping

import numpy as np

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result, StemComparison
from valve_friction_ros.identification.settings import SLIDING, UNITS, IdentificationSettings
from valve_friction_ros.identification.signature.valve_signature import (
    TRIANGLE_NEEDED,
    BreakawayPoint,
    SignatureStroke,
    ValveSignature,
    Ways,
    breakaway_points,
    leaving_speed,
    mean_position_bias,
    mean_spring_constant,
    sliding_friction,
    sliding_places,
    sliding_speed,
    valve_signature,
)
from valve_friction_ros.identification.steps.validation import (
    IdentifiedModel,
    Validation,
    identified_model,
    validate,
)
from valve_friction_ros.identification.trust import excitation
from valve_friction_ros.identification.trust.plausible_units import require_plausible_units
from valve_friction_ros.identification.trust.uncertainty import (
    FINEST_SLIDING,
    Jackknife,
    half_width,
    jackknife,
)
from valve_friction_ros.identification.trust.verdict import (
    FALL_SPEED,
    LEAST_FIT,
    PRELOAD_SCALE,
    Parameter,
    fixed,
    not_identifiable,
    stem_distance,
    with_verdict,
)
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import MeasuredRecord, measured
from valve_friction_ros.wording import percentage

METHOD = "signature"
"""Name of this method."""

_FEWEST_EACH_WAY = 2
"""Least strokes each way: fewer leave no scatter within a direction, so no standard error."""

_SURE = 4.0
_LEAST_SLIP = 0.03
"""Least slip jump, in its standard errors and as a share of F_s.

Chosen: F_s itself may be off by 1 % (`_BREAKAWAY_BIAS`), so a third of that limit is no
evidence."""

_HIDDEN = "the stem jumps as it breaks away, too fast or by too little to measure in this record"

_BREAKAWAY_BIAS = 0.01
_STIFFNESS_BIAS = 2e-3
"""Errors of F_s at the breakaway points, and of k, that all strokes share, as shares of the value.

The largest errors in simulated records of three packings (Notes of `identify_signature`)."""


def identify_signature(
    recording: Recording,
    valve: Valve,
    settings: IdentificationSettings | None = None,
) -> Result:
    """Identify a valve signature by force balances, as the paper's model 2.

    k is the mean of (15), x̄ follows from (14), F_s from (11) and (12) at the breakaway points,
    F_c is F_s, and F_v the mean of (19) while the stem slides; the sliding friction is half the
    dead zone as a force. Intervals come from the scatter between strokes, widened by the errors
    that all strokes may share: 1 % of F_s, 0.2 % of k, 0.3 % of the sliding friction.

    Parameters
    ----------
    recording : Recording
        A valve signature, two strokes or more each way from rest at a constant speed
        (`TriangleWave` with its period of 60 s suits the bench valve).
    valve : Valve
        Geometry.
    settings : IdentificationSettings, optional
        Fixed parameters, position bias, assumed mass and derivative window (of the velocity; by
        default the noise chooses it). The settings of the sweep do not apply.

    Returns
    -------
    Result
        Parameters with intervals and verdicts, and the signature.

    Raises
    ------
    RefusalError
        If the record is not a valve signature (the message names the excitation that gives
        a signature), or if the model does not reproduce the record.

    Notes
    -----
    Read off a plot, as published, a breakaway point lies where the line of the sliding stem
    begins, and F_s comes out as F_c + F_v·|ẋ|, with F_v = 0 in (19): on the bench at 1.19 mm/s
    that is 3.8 % (low friction) and 8.8 % (high friction) too much. The onset is located here
    instead (`fit_onset`), where the speed is still zero. On simulated records of 150 s, five
    strokes, with no noise up to 28.6 µm / 165 Pa, F_s came within 1 % for all three packings, k
    within 0.2 % and x̄ within 0.05 mm. F_v is a small difference: an error of 1 % in F_c is one of
    26 % (low) or 11 % (high) in F_v.

    With a slip jump F_c is not F_s, which the paper leaves to future work. The loop's half width
    is then F_c + F_v·|ẋ|, and as the stem leaves at the speed v_j, the force balance is
    F_s = F_c + F_v·v_j: their difference gives F_v = (F_s − half width)/(v_j − |ẋ|), and F_c
    follows. A jump smaller than F_v·|ẋ| does not show.
    """
    settings = settings or IdentificationSettings()
    if settings.fixed.get("spring_constant") == 0:
        raise RefusalError("the force balance needs a spring: use the method plant or bench")
    record = _measured(recording, valve, settings)
    signature = valve_signature(record, valve, settings.derivative_window)
    ways = _from_rest(signature)
    found = _balanced(ways, settings)
    parameters = _parameters(found, ways, settings)
    values = {name: one.value for name, one in parameters.items()}
    mass = settings.fixed.get("mass", settings.assumed_mass)
    identified, validation = _validated(record, valve, {**values, "mass": mass})
    return Result(
        method=METHOD,
        recording=recording,
        valve=valve,
        settings=settings,
        parameters=parameters,
        fit=validation.fit,
        rms=validation.rms,
        misfit=None,
        derivative_window=signature.window,
        warnings=identified.notes,
        evidence=_evidence(signature, valve.driven_by),
        findings=_findings(signature, validation, valve),
        model=identified.parameters,
        exhibit=signature,
        stem=StemComparison(recording.sample_period, recording.position, validation.simulated),
        sliding_speed=sliding_speed(ways),
    )


def _measured(
    recording: Recording, valve: Valve, settings: IdentificationSettings
) -> MeasuredRecord:
    """Return the signals; raises RefusalError where they cannot be a valve signature."""
    record = measured(recording)
    excitation.require_unbroken(record)
    require_plausible_units(record, valve, settings)
    excitation.require_enough_samples(record, settings.published_window)
    excitation.require_motion(record, valve.travel)
    excitation.require_travel(record, valve)
    excitation.require_related_signals(record)
    return record


def _validated(
    record: MeasuredRecord, valve: Valve, values: Mapping[str, float]
) -> tuple[IdentifiedModel, Validation]:
    """Return the model and how it reproduces the record; raises RefusalError if it does not."""
    try:
        identified = identified_model(values)
    except ValueError as error:
        raise RefusalError(
            f"the force balances give an impossible model: {error}; check both signals"
        ) from None
    validation = validate(record, valve, identified.parameters)
    if validation.fit < LEAST_FIT:
        raise RefusalError(
            f"the model of the force balances does not reproduce the record (fit "
            f"{100 * validation.fit:.0f} %): check fixed parameters, both signals and their clocks"
        )
    return identified, validation


def _from_rest(signature: ValveSignature) -> list[list[SignatureStroke]]:
    """Return the strokes from rest, each way; raises RefusalError where they are too few."""
    ways = [[one for one in way if one.breakaway is not None] for way in signature.ways]
    if min(map(len, ways)) < _FEWEST_EACH_WAY:
        raise RefusalError(
            f"the force balance needs {_FEWEST_EACH_WAY} strokes from rest in each direction; the "
            f"record has {len(ways[0])} up and {len(ways[1])} down: {TRIANGLE_NEEDED}"
        )
    return ways


def _balanced(ways: Ways, settings: IdentificationSettings) -> Jackknife:
    """Return what the force balances give; raises RefusalError for a friction below zero."""
    found = jackknife(ways, lambda some: _figures(some, settings))
    if found.values["static_friction"] <= 0:
        raise RefusalError(
            "the breakaway points give a negative static friction, "
            f"{found.values['static_friction']:.4g} N: check the direction and the clocks of both "
            "signals"
        )
    return found


def _evidence(signature: ValveSignature, driven_by: Drive) -> dict[str, object]:
    def shown(point: BreakawayPoint) -> dict[str, float]:
        values = point._asdict()
        drive = values.pop("drive")
        return values if driven_by is Drive.FORCE else values | {"pressure": drive}

    return {
        "position_bias": signature.position_bias,
        "dead_zone": signature.dead_zone,
        "dead_zone_share": signature.dead_zone_share,
        "breakaway_points": [
            {"direction": stroke.direction, **shown(stroke.breakaway)}
            for stroke in signature.strokes
            if stroke.breakaway is not None
        ],
    }


def _findings(signature: ValveSignature, validation: Validation, valve: Valve) -> tuple[str, ...]:
    upward, downward = signature.upward_points, signature.downward_points
    drive = valve.driven_by
    return (
        f"fit {100 * validation.fit:.2f} %: the stem of the model is "
        f"{stem_distance(validation.rms, valve)}",
        f"signature: {len(upward)} strokes up and {len(downward)} down, bias x̄ "
        f"{signature.position_bias * 1e3:.4g} mm, dead zone "
        f"{signature.dead_zone / drive.size:.4g} {drive.unit}, "
        f"{percentage(signature.dead_zone_share)} of the {drive.words}'s span",
    )


def _figures(ways: Ways, settings: IdentificationSettings) -> dict[str, float]:
    """Evaluate (11) to (15) and (19) on these strokes, with the fixed parameters as given."""
    given = settings.fixed
    spring_constant = given.get("spring_constant", mean_spring_constant(ways))
    bias = settings.position_bias
    if bias is None:
        if "spring_preload" in given:
            bias = given["spring_preload"] / spring_constant
        else:
            bias = mean_position_bias(ways, spring_constant)
    pulls = [
        direction
        * float(np.mean([one.force - spring_constant * (one.position + bias) for one in points]))
        for direction, points in zip((1, -1), map(breakaway_points, ways), strict=True)
    ]
    static_friction = given.get("static_friction", float(np.mean(pulls)))
    coulomb_friction = given.get("coulomb_friction", static_friction)
    sliding = sliding_friction(ways, spring_constant)
    slip = static_friction - sliding
    leaving, speed = leaving_speed(ways), sliding_speed(ways)
    falling = slip / (leaving - speed) if leaving > speed else math.nan
    return {
        "spring_constant": spring_constant,
        "spring_preload": spring_constant * bias,
        "static_friction": static_friction,
        "coulomb_friction": coulomb_friction,
        "viscous_friction": _viscous_friction(ways, coulomb_friction, spring_constant, bias),
        SLIDING: sliding,
        "slip": slip,
        "viscous_friction after a jump": falling,
        "coulomb_friction after a jump": static_friction - falling * leaving,
    }


def _viscous_friction(
    ways: Ways, coulomb_friction: float, spring_constant: float, bias: float
) -> float:
    """Average (19) over the sliding instants of each stroke, and over the strokes."""
    means = []
    for way in ways:
        for stroke in way:
            sliding = stroke.sliding
            spring = spring_constant * (sliding.position + bias)
            left = sliding.force - stroke.direction * coulomb_friction - spring
            means.append(float(np.mean(left / sliding.velocity)))
    return float(np.mean(means))


def _parameters(
    found: Jackknife, ways: Ways, settings: IdentificationSettings
) -> dict[str, Parameter]:
    """Give each parameter its verdict, from the scatter of strokes and the bias of the method."""
    values, errors = found.values, found.standard_errors
    speed = sliding_speed(ways)
    points = [point for way in ways for point in breakaway_points(way)]
    place = float(np.mean([abs(point.position) for point in points]))
    force_range = float(np.ptp([point.force for point in points]))
    stiffness = _STIFFNESS_BIAS * values["spring_constant"]
    friction = _BREAKAWAY_BIAS * values["static_friction"]
    biases = {
        "viscous_friction": friction / speed,
        "coulomb_friction": friction,
        "static_friction": friction,
        "spring_constant": stiffness,
        "spring_preload": stiffness * place,
        SLIDING: 0.5 * stiffness * abs(sliding_places(ways)) + FINEST_SLIDING * values[SLIDING],
    }
    least_slip = max(_SURE * errors["slip"], _LEAST_SLIP * values["static_friction"])
    jumps = values["slip"] > least_slip and "coulomb_friction" not in settings.fixed
    slow = (
        ""
        if speed >= FALL_SPEED
        else f"valid at {speed * 1e3:.2g} mm/s, the sliding speed of the record: "
        f"friction may fall further up to {FALL_SPEED * 1e3:.2g} mm/s"
    )
    parameters = {
        "mass": not_identifiable(
            "mass",
            f"at a constant speed inertia has no effect; {settings.assumed_mass:g} kg is assumed",
        )
    }
    for name, bias in biases.items():
        is_sliding = name in ("coulomb_friction", "viscous_friction")
        source = f"{name} after a jump" if jumps and is_sliding else name
        if math.isnan(values[source]):
            parameters[name] = not_identifiable(name, _HIDDEN)
        elif name == "viscous_friction" and values[source] < 0:
            reason = f"its estimate is negative ({values[source]:.4g} N·s/m)"
            parameters[name] = not_identifiable(name, reason)
        else:
            width = half_width(errors[source], found.freedom) + bias
            doubt = slow if is_sliding else ""
            scale = PRELOAD_SCALE * force_range if name == "spring_preload" else 0.0
            parameters[name] = with_verdict(
                name, values[source], errors[source], width, doubt, scale
            )
    given = {name: fixed(name, value) for name, value in settings.fixed.items() if name in UNITS}
    return {**parameters, **given}
