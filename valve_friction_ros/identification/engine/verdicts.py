# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts on the numbers of a fit with imperfections, and sentences on the fit and its record."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import SLOW_SAMPLING, without_repeats
from valve_friction_ros.identification.engine.coordinates import IMPERFECTIONS, TIMING, Profile
from valve_friction_ros.identification.engine.friction_curve import FrictionCurve
from valve_friction_ros.identification.engine.intervals import (
    AT_REST,
    AVERAGES,
    NOISE_LIKE,
    NOT_QUITE,
    OMITTED,
    ROUNDING,
    STROKES,
    UNLIKELY,
    UNSEEN,
    Estimated,
)
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.settings import SLIDING, UNITS, IdentificationSettings
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE
from valve_friction_ros.identification.trust.verdict import (
    COVERAGE,
    FALL_SPEED,
    NO_SLIP,
    PRELOAD_SCALE,
    WEAK_SHARE,
    Misfit,
    Parameter,
    Verdict,
    fixed,
    interval_share,
    not_identifiable,
    share_of,
    with_verdict,
)
from valve_friction_ros.model.recording import Recording, StampedRecord, StampedSignal
from valve_friction_ros.signals import quantisation_step, stamped_noise
from valve_friction_ros.wording import LAG_SETTING, lasting, percentage, three_digits, two_digits

_SURE = 3.0
_LEAST_SLIP = 0.1
"""Slip force over F_s above which there is a slip jump.

The slip force cannot be negative, so that noise alone makes it positive."""

_OTHERS = {
    "start_position": "initial stem position",
    ROUNDING: "force within one step of the converter",
    OMITTED: "changes too small for the source to send or to store",
    UNSEEN: "what happens between two samples",
    STROKES: "why the strokes differ",
    AVERAGES: "what averages over other times would show",
    AT_REST: "how friction at rest differs from that of the moves",
    "lag": "lag between the signals",
}
"""Words for the sources of uncertainty that are not imperfections."""

_SHARE = 0.2
"""Share of the variance above which a source is named."""


_WITHOUT_SIDE = ("curvature", "cubic", "drift")
"""Imperfections whose sign says nothing to a reader."""


def _size(name: str, value: float) -> str:
    if name in TIMING:
        return f"{two_digits(1e3 * abs(value))} ms"
    if name == "presliding":
        return f"{1e6 * value:.2g} µm"
    if name == "limit_velocity":
        return f"{1e3 * value:.2g} mm/s"
    if name == "slip_force":
        return f"F_s above F_c by {three_digits(value)} N"
    if name in ("along_travel", "in_record"):
        way = "rises" if value > 0 else "falls"
        return f"friction {way} by {percentage(2 * abs(value))}"
    return percentage(abs(value) if name in _WITHOUT_SIDE else value)


def slips(fit: PosteriorFit) -> bool:
    """Return whether F_s lies above F_c by more than chance and its bound at F_c explain."""
    static = fit.at["coulomb_friction"] + fit.at["slip_force"]
    return fit.at["slip_force"] > max(_SURE * fit.deviation("slip_force"), _LEAST_SLIP * static)


def found_imperfections(fit: PosteriorFit, lag: Estimated) -> tuple[str, ...]:
    """Return a sentence for each imperfection that is certain, the most certain first.

    A single source of a lag is certain only if their sum is, `lag`, s, over all probable fits, and
    if it explains that sum alone: sources that compensate each other may all be absent.
    """
    found = []
    is_late = abs(lag.value) > _SURE * lag.half_width / NORMAL_QUANTILE
    for name in fit.names:
        value, deviation, one = fit.at[name], fit.deviation(name), IMPERFECTIONS.get(name)
        if name == "slip_force" and not slips(fit):
            continue
        if name in TIMING and not (is_late and abs(value - lag.value) <= lag.half_width):
            continue
        if one and abs(value) > max(one.least, _SURE * deviation):
            found.append((deviation / abs(value), f"{one.words}: {_size(name, value)}"))
    return tuple(sentence for _, sentence in sorted(found))


def main_doubt(one: Estimated, width: str) -> str:
    """Name what makes an interval wide: the imperfections that the record leaves open.

    `width` is the text of `interval_share`.
    """
    sources = dict(one.sources)
    if not any(name in TIMING for name in sources):
        sources["lag"] = one.timing
    total = sum(source**2 for source in sources.values()) + one.record**2
    named = [
        _OTHERS[name] if name in _OTHERS else IMPERFECTIONS[name].words
        for name, source in sorted(sources.items(), key=lambda item: -item[1])
        if source**2 > _SHARE * total
    ]
    share = f"its interval is {width}"
    if not named:
        return f"{share}, due to noise and to motion that the model does not explain"
    return f"{share}; not determined by the record: {', '.join(named[:3])}"


def late_sensor(name: str, value: float) -> str:
    """Say what a number would be if the sensor of the stem were slow."""
    unit = UNITS.get(name, "N")
    return (
        f"it would be {value:.3g} {unit} with a slow stem sensor, whose lag the record cannot "
        f"separate from viscous friction; state {LAG_SETTING}"
    )


_JITTER = 0.01
"""Scatter of the pauses, over the period, above which stamps are irregular."""

_IRREGULAR = 0.25
"""The same, above which a pause no longer shows whether a sample is missing."""

_DROPS = 0.005
"""Share of missing samples above which they are reported."""

_LONG = 1.5
"""Pause, over the period, from which a sample may be missing."""

_GAP = 10.0
_RATES = 1.5
_HELD = 1.5
"""Mean number of equal samples in a row, while the signal moves, above which it is held."""

_COARSE, _LEAST_COARSE = 1.0, 2e-4
"""Step of a converter, over the deviation of the noise and over the range of the signal (twelve
bits), above which the step is coarse: where there is no noise, decimals are no converter."""

_LASTING = 0.016
"""Time, s, between samples whose noise is compared with that of neighbours."""

_COLOURED = 2.0
"""Noise, over that of neighbours, above which it is reported as lasting.

It is 1 for white noise, up to 1.5 in a benchmark's records of jerking stems, 2.6 and more where
noise has a memory of 5 ms."""

_FEWEST = 500
_SLOW = 0.02
"""Period, s, above which a slow stem may not be followed through its corners."""


def _missing_share(pauses: NDArray[np.float64]) -> float:
    """Share of the samples that are missing, from `pauses` over the period, outside gaps.

    A pause is long because of a lost sample or jitter. Jitter takes from the neighbouring pauses
    what it adds to this one, so they are counted with it.
    """
    near = pauses[pauses <= _GAP]
    long = np.convolve(near >= _LONG, np.ones(3), "same") > 0
    ordinary = near[~long] if (~long).any() else near[near < _LONG]
    missing = float(np.sum(near[long])) / float(np.mean(ordinary)) - np.count_nonzero(long)
    return max(missing, 0.0) / (near.size + 1 + max(missing, 0.0))


def _stamp_remarks(name: str, signal: StampedSignal) -> list[str]:
    pauses = np.diff(signal.time) / signal.period
    scatter = float(np.std(pauses[pauses < _LONG]))
    lost = _missing_share(pauses)
    remarks = []
    if scatter > _JITTER:
        remarks.append(f"the stamps of {name} jitter by {percentage(scatter)} of their interval")
    if lost > _DROPS and scatter < _IRREGULAR:
        remarks.append(f"{percentage(lost)} of the samples of {name} are missing")
    gaps = pauses[pauses > _GAP]
    if gaps.size:
        seconds = float(np.sum(gaps)) * signal.period
        count = "a gap" if gaps.size == 1 else f"{gaps.size} gaps"
        remarks.append(f"{count} in {name}, {lasting(seconds)} in total, left out")
    return remarks


def _value_remarks(name: str, signal: StampedSignal, size: float, unit: str) -> list[str]:
    """Return remarks on the values of a signal, in a unit with its size in SI units."""
    changes = np.flatnonzero(np.diff(signal.value))
    remarks: list[str] = []
    if changes.size < 2:
        return remarks
    runs = np.diff(changes)
    held = float(np.median(runs))
    step = quantisation_step(signal.value)
    noise = stamped_noise(signal)
    if held > _HELD:
        remarks.append(
            f"values of {name} hold for {lasting(held * signal.period)}: a slow source, or the "
            "dead band of a historian"
        )
    if step > max(_COARSE * noise, _LEAST_COARSE * float(np.ptp(signal.value))):
        remarks.append(
            f"the resolution of {name} is coarse: its steps of {step / size:.3g} {unit} exceed the "
            "noise"
        )
    return remarks


def _noise_remarks(name: str, signal: StampedSignal) -> list[str]:
    remarks, noise = [], stamped_noise(signal)
    apart = int(_LASTING / signal.period)
    if apart > 1 and signal.value.size > _FEWEST * apart:
        lasting = stamped_noise(StampedSignal(signal.time[::apart], signal.value[::apart]))
        if lasting > _COLOURED * noise:
            remarks.append(
                f"the noise of {name} is not white: {two_digits(lasting / noise)} times as large "
                f"over {1e3 * _LASTING:g} ms as between successive samples"
            )
    return remarks


def sampling_remarks(record: StampedRecord) -> tuple[str, ...]:
    """Return a sentence for each way in which the samples differ from those of a good sensor."""
    remarks, drive = [], record.driven_by
    for name, signal, size, unit in (
        (f"the {drive.words}", record.drive, drive.size, drive.unit),
        ("the stem", record.position, 1e-6, "µm"),
    ):
        remarks += _stamp_remarks(name, signal) + _value_remarks(name, signal, size, unit)
        remarks += _noise_remarks(name, without_repeats(signal))
    periods = record.drive.period, record.position.period
    if max(periods) > _RATES * min(periods):
        remarks.append(
            f"the signals have different rates: {drive.words} {1 / periods[0]:.3g} Hz, stem "
            f"{1 / periods[1]:.3g} Hz"
        )
    if max(periods) > _SLOW:
        remarks.append(f"the sampling is slow: {1 / max(periods):.3g} Hz")
    return tuple(remarks)


def archive_remarks(recording: Recording, held: StampedRecord) -> tuple[str, ...]:
    """Name the signals of a recording that a historian has interpolated, as they are `held`."""
    words, given = recording.driven_by.words, recording.stamped or recording
    changed = []
    for name, one, other in (
        (f"the {words}", given.drive, held.drive.value),
        ("the stem", given.position, held.position.value),
    ):
        values = one.value if isinstance(one, StampedSignal) else one
        if values.size == other.size and not np.array_equal(values, other):
            changed.append(name)
    if not changed:
        return ()
    verb = "lie" if len(changed) > 1 else "lies"
    return (
        f"{' and '.join(changed)} {verb} on lines between stored values, as a historian "
        "interpolates: each stored value is held until the next",
    )


USABLE = 0.1
"""Half width over value up to which a sliding friction is of use to maintenance.

Chosen: well below the 25 % of growth that raises the first alarm."""

_FAILED = 100.0
"""Inflation of the residual beyond which no number that only the simulation gives is reported: ten
times the noise."""

_FURTHER, _BELOW_TOP = 0.35, 0.95
"""Half width, over F_c, of its further fall beyond the speeds of a slow record: in packings that
slip, F_s is up to twice F_c, and half of all packings slip. And the share of the distance below the
top speed: a short peak shows no friction."""

_BY_SPEED = ("coulomb_friction", "viscous_friction", "static_friction", "stribeck_velocity")
"""Numbers into which a friction that falls with speed divides differently at higher speeds."""

_EXTRAPOLATED = (
    "it lies outside the stroke recorded, and the spring is not identified well "
    "enough to extrapolate"
)

_UNCONFIRMED = "it follows from the forces alone and is not confirmed by simulation"
_OF_THE_BALANCE = (SLIDING, "spring_constant", "spring_preload")
"""Numbers that the force balance of the sliding stem determines without a simulation."""

_OF_SLIP = ("static_friction", "stribeck_velocity")
"""Numbers that a simulation determines by the forces at which its stem leaves a rest, even if the
noise of the sensor is not quite white."""

_NOISE_SHARE, _LEAST = 0.2, 2e-4
"""Shares of the stem's noise and of its range in the misfit that is tolerated on a bench; the
latter also on a plant.

Chosen: 70 of 71 simulated records of Karnopp valves stay within it."""


def fit_misfit(
    fit: PosteriorFit, numbers: Mapping[str, Estimated], profile: Profile = Profile.PLANT
) -> Misfit:
    """Return how well the simulated stem follows the measured one.

    The model of a plant is doubted only where its misfit exceeds noise and a small share of the
    range, and the friction stays uncertain: where the interval of the sliding friction is wider
    than twice `USABLE`. The model of a bench is doubted where its misfit exceeds the effect of
    pressure noise on the simulated stem, by the difference of both halves, plus small shares of the
    stem's noise and range.
    """
    record = fit.model.record
    rms = float(np.sqrt(np.mean(fit.residual**2)))
    fitted = 1.0 - rms / float(np.std(record.position))
    noise = float(np.mean(record.noise**2 / record.samples))
    if not profile.has_imperfections:
        even, odd = record.position - fit.model.readings(fit.at)
        systematic = math.sqrt(max(float(np.mean(even * odd)) - noise, 0.0))
        by_pressure = min(0.25 * float(np.mean((even - odd) ** 2)), noise)
        tolerated = (
            math.sqrt(by_pressure)
            + _NOISE_SHARE * math.sqrt(noise)
            + _LEAST * float(np.ptp(record.position))
        )
        return Misfit(fitted, rms, systematic, tolerated)
    systematic = math.sqrt(max(rms**2 - noise, 0.0))
    sliding = numbers["sliding_friction"]
    certain = sliding.half_width <= 2.0 * USABLE * abs(sliding.value)
    small = systematic <= _LEAST * float(np.ptp(record.position))
    describes = certain or small or fit.inflation < NOISE_LIKE
    return Misfit(fitted, rms, systematic, systematic if describes else 0.5 * systematic)


def fit_verdicts(
    fits: Sequence[PosteriorFit],
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    misfit: Misfit,
    profile: Profile,
    reach: float,
) -> dict[str, Parameter]:
    """Return every reported number of the first fit with its verdict.

    Where the model is doubted, no number is more than weak. Where the misfit of a plant exceeds
    noise, or the search ended before it tried other lags, the numbers of the force balance
    (`checked_by_curve`) may still be identified. Lags beyond the `reach` of their prior, s, are not
    believed.
    """
    fit, doubt = fits[0], ""
    force_range = float(np.ptp(fit.model.record.force))
    if not misfit.describes:
        doubt = (
            "the Karnopp model does not describe this valve: "
            f"{two_digits(misfit.systematic * 1e6)} µm of the misfit is more than noise"
        )
    top = _top_speed(fit)
    slow, split = _slow_doubt(top), split_doubt(fits, misfit, profile, reach)
    unseen = _unseen(fit, numbers, settings, split)
    verdicts = {}
    for name, one in numbers.items():
        width = one.half_width
        if slow and name == "coulomb_friction":
            width = math.hypot(width, _FURTHER * (1.0 - top / FALL_SPEED) * abs(one.value))
        reason = doubt or (slow if name in _BY_SPEED else "")
        if split and not (name in _OF_SLIP and fit.inflation <= NOISE_LIKE):
            reason = "" if name in _OF_THE_BALANCE else reason or split
        if name in settings.fixed and name != "limit_velocity":
            verdicts[name] = fixed(name, settings.fixed[name])
        elif name in unseen:
            verdicts[name] = not_identifiable(name, unseen[name])
        else:
            verdicts[name] = judged(name, one, width, reason, force_range)
    return _no_surer_than_its_spring(verdicts)


def judged(
    name: str, one: Estimated, width: float, reason: str = "", force_range: float = 0.0
) -> Parameter:
    """Give a number its verdict by this half width; without a reason, its main doubt is one.

    A preload that is small against the `force_range` of the record, N, is judged by that range.
    """
    scale = PRELOAD_SCALE * force_range if name == "spring_preload" else 0.0
    share = share_of(one.value, width, scale)
    if not reason and WEAK_SHARE < share < math.inf:
        reason = main_doubt(one, interval_share(one.value, share, scale))
    if not reason and one.has_rival:
        reason = late_sensor(name, one.rival)
    return with_verdict(name, one.value, width / COVERAGE, width, reason, scale)


def _no_surer_than_its_spring(verdicts: dict[str, Parameter]) -> dict[str, Parameter]:
    """Return the verdicts, with the preload identified only where the spring is known.

    In three draws 832 of 836 preloads whose spring was identified too lay inside their intervals;
    of 52 others 48, and two were far off.
    """
    preload, spring = verdicts.get("spring_preload"), verdicts.get("spring_constant")
    if preload is None or spring is None or preload.verdict is not Verdict.IDENTIFIED:
        return verdicts
    if spring.verdict in (Verdict.IDENTIFIED, Verdict.FIXED):
        return verdicts
    weak = replace(preload, verdict=Verdict.WEAK, reason=_EXTRAPOLATED)
    return {**verdicts, "spring_preload": weak}


BY_LEVELS = (
    "it is the friction near rest, from the levels at which force and stem rest: no move confirms "
    "it, and viscous friction of faster moves comes on top"
)


def unlike_levels(value: float) -> str:
    """Say that the moves between levels show another sliding friction, N."""
    return (
        f"the moves between the levels show {three_digits(value)} N, the levels at which force and "
        "stem rest another value: one signal may be recorded late"
    )


_LEAST_REPRODUCED = 0.6
"""Share of the force below which the balance of a slow record says nothing of friction.

Chosen: of three such records among 156, two were off by 2.4 and 9.1 half widths."""


def doubted_by_sampling(
    parameters: Mapping[str, Parameter], change: float, interval: float, reproduced: float = 1.0
) -> dict[str, Parameter]:
    """Return the verdicts, with friction at most weak where the order of the samples decides it.

    A slow historian reads its signals in turn: one may be as old as a sampling `interval`, s, which
    makes a `change`, N, of the sliding friction. A friction that is smaller is not identifiable, as
    is one whose balance has not `reproduced` most of the force.
    """
    sliding = parameters[SLIDING]
    if interval > SLOW_SAMPLING and reproduced < _LEAST_REPRODUCED:
        reason = (
            f"the force balance reproduces only {percentage(reproduced)} of the force, because the "
            f"stem moves faster than samples every {lasting(interval)} can show"
        )
        sliding = not_identifiable(SLIDING, reason)
        return weakened({**parameters, SLIDING: sliding}, reason)
    if not abs(change) > sliding.half_width:
        return dict(parameters)
    reason = (
        f"one signal recorded a sample ({lasting(interval)}) late would change the sliding "
        f"friction by {three_digits(abs(change))} N; state {LAG_SETTING}: 0 if both signals are "
        "sampled together"
    )
    if abs(change) > abs(sliding.value):
        sliding = not_identifiable(SLIDING, reason)
    elif sliding.verdict is Verdict.WEAK:
        sliding = replace(sliding, reason=f"{sliding.reason}; {reason}")
    return weakened({**parameters, SLIDING: sliding}, reason)


def weakened(parameters: Mapping[str, Parameter], reason: str) -> dict[str, Parameter]:
    """Return the verdicts, with each identified friction weak for a reason."""
    return {
        name: replace(one, verdict=Verdict.WEAK, reason=reason)
        if name in (SLIDING, *_BY_SPEED) and one.verdict is Verdict.IDENTIFIED
        else one
        for name, one in parameters.items()
    }


def split_doubt(
    fits: Sequence[PosteriorFit], misfit: Misfit, profile: Profile, reach: float
) -> str:
    """Return why the simulated stem determines no more than the force balance does, if so.

    The residual of a plant exceeds noise, its imperfections are improbable, the lag is impossible,
    or the search could not trade viscous friction for lag while both are unknown.
    """
    best = fits[0]
    is_plant = profile.has_imperfections
    if best.inflation > NOT_QUITE and is_plant:
        return (
            f"no friction model here reproduces the motion exactly ("
            f"{two_digits(1e6 * misfit.systematic)} µm of the deviation is more than noise): the "
            "sliding friction is reliable, its components are not"
        )
    if best.penalty > UNLIKELY and is_plant:
        return (
            "the best fit needs imperfections that are improbable together: something else in the "
            "motion looks like them"
        )
    if abs(best.lag) >= reach:
        return (
            f"the best fit puts the signals {1e3 * abs(best.lag):.0f} ms apart, which is not "
            "plausible: something else in the motion looks like a lag"
        )
    if len(fits) > 1 or "viscous_friction" not in best.names or not best.lags.any():
        return ""
    return "the search ended before it tried other lags: use a shorter record"


def _unseen(
    fit: PosteriorFit,
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    split: str,
) -> dict[str, str]:
    """Return which of mass, F_v, F_s and v_s the record does not show, and why."""
    why = {}
    viscous = numbers.get("viscous_friction")
    if viscous is not None and math.isinf(viscous.half_width):
        why["viscous_friction"] = split
    mass = numbers.get("mass")
    if mass is not None and ("mass" in fit.kept or mass.half_width > abs(mass.value)):
        why["mass"] = (
            "inertia is too small a part of the force to be identified; "
            f"{settings.assumed_mass:g} kg is assumed"
        )
    for name in ("static_friction", "stribeck_velocity"):
        one = numbers.get(name)
        if one is not None and not (slips(fit) and fit.at["slip_force"] > one.half_width):
            why[name] = NO_SLIP
        elif split and fit.inflation > _FAILED:
            why[name] = split
    return why


def curve_misfit(curve: FrictionCurve, sliding: Estimated) -> Misfit:
    """Return how well the force balance of the sliding stem reproduces the force, N.

    As for a simulation, the model is doubted only where the sliding friction stays uncertain.
    """
    systematic = curve.misfit * math.sqrt(max(1.0 - 1.0 / curve.inflation, 0.0))
    describes = sliding.but_rounding <= 2.0 * USABLE * abs(sliding.value)
    tolerated = systematic if describes else 0.5 * systematic
    return Misfit(curve.fit, curve.misfit, systematic, tolerated, "N")


def curve_verdicts(
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    stribeck_velocity: float,
    force_range: float = 0.0,
) -> dict[str, Parameter]:
    """Return every reported number of a force balance with its verdict.

    Mass, spring, preload and sliding friction may be identified. The components of the sliding
    friction are at most weak, as no simulated stem confirms them.
    """
    verdicts = {}
    for name in (*UNITS, SLIDING):
        one = numbers.get(name)
        if name in settings.fixed and name != "limit_velocity":
            verdicts[name] = fixed(name, settings.fixed[name])
        elif name == "static_friction" and not stribeck_velocity:
            verdicts[name] = not_identifiable(name, NO_SLIP)
        elif one is None or (one.value < 0 and name != "spring_preload"):
            verdicts[name] = not_identifiable(name, "the record does not determine it")
        else:
            reason = _UNCONFIRMED if name in _BY_SPEED else ""
            verdicts[name] = judged(name, one, one.half_width, reason, force_range)
    return _no_surer_than_its_spring(verdicts)


def _top_speed(fit: PosteriorFit) -> float:
    """Return the speed above which the stem covers a twentieth of its distance, m/s."""
    speed = np.sort(fit.model.record.slow.speed)
    distance = np.cumsum(speed)
    return float(speed[np.searchsorted(distance, _BELOW_TOP * distance[-1])])


def _slow_doubt(top: float) -> str:
    """Say that the record is too slow to separate F_c from friction at low speed, or nothing."""
    if top >= FALL_SPEED:
        return ""
    return (
        f"valid up to {top * 1e3:.2g} mm/s; the stem was rarely faster, and friction may still "
        f"fall between there and {FALL_SPEED * 1e3:.2g} mm/s"
    )
