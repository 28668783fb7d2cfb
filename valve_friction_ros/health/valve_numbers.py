# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Numbers of the whole valve from a result: parameters, range of motion, sensor noise."""

import contextlib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.health.measured import DIFFERENCES, Measured
from valve_friction_ros.held_signals import without_repeats
from valve_friction_ros.identification.drawing import IMPERFECTIONS_FOUND
from valve_friction_ros.identification.refusal import LittleMotionError, RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.excitation import (
    require_drive,
    require_motion,
    require_related_signals,
    require_travel,
    require_two_directions,
    require_within_travel,
)
from valve_friction_ros.identification.trust.plausible_units import require_plausible_units
from valve_friction_ros.identification.trust.uncertainty import COMPARABLE, SPEED_EXPONENT
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.model.recording import Recording, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import quantisation_step, runs_of, sensor_noise, stamped_noise

_MEAN = 0.1
"""Averaging time of the stem position, s."""

_NEAR = 2e-3
"""Distance from an end, over the range, within which the stem is at the end: a seat yields."""

_NOISE = 6.0
"""The same distance in deviations of the averaged noise; the larger of both applies."""

_LEFT = 2.0
"""Distance at which the stem has left an end, over the distance within which it is at the end."""

_SURELY = 2.0
"""Growth of the force over F_s − F_c: a stem that has jumped too far waits for twice as much."""

_SMALLEST = 0.05
"""Least growth of the force that proves a stop, over the range of the force.

Chosen: within the distance that is taken as the end, the spring force grows, too."""
_MOVING = 0.05
"""Speed over the top speed from which the stem is moving."""

_RECENT = 0.5
"""Time, s, before an arrival over which the highest speed is taken; no lag of a stem is longer."""


def stem_reach(recording: Recording, valve: Valve, slip_force: float) -> dict[str, Measured]:
    """Return the ends of the stem's motion, m, and the stops that it met.

    These are ``lowest_position``, ``highest_position``, ``lower_stop`` and ``upper_stop``.

    A stem at rest moves on as soon as the force has grown by F_s − F_c in the same direction. If it
    rests at an end of its motion while the force grows by far more, a stop holds it. `slip_force`
    is the largest possible F_s − F_c, N. If it is nan, it is estimated from rests between the ends.
    Without such a rest, growth by F_c is required.
    """
    mean = max(round(_MEAN / recording.sample_period), 1)
    position = scipy.ndimage.uniform_filter1d(recording.position, mean, mode="nearest")
    force = valve.actuator_force(
        scipy.ndimage.uniform_filter1d(recording.drive, mean, mode="nearest")
    )
    noise = sensor_noise(recording.position) / math.sqrt(mean)
    sent = recording.position if recording.stamped is None else recording.stamped.position.value
    step = quantisation_step(sent)  # interpolation to the record's grid may hide it
    near = max(_NEAR * float(np.ptp(position)), _NOISE * noise, step)
    least: NDArray[np.float64] = np.full(position.size, _SURELY * slip_force)
    if math.isnan(slip_force):
        least = _unknown_growth(position, force, recording.sample_period, near)
    least = np.maximum(least, _SMALLEST * float(np.ptp(force)))
    found = {}
    for side, end, stop in (
        (-1.0, "lowest_position", "lower_stop"),
        (1.0, "highest_position", "upper_stop"),
    ):
        farthest = float(np.max(side * position))
        found[end] = Measured(side * farthest, near)
        held = _held(farthest - side * position, near, side * force, least)
        if held.any():
            low, middle, high = np.quantile(position[held], (0.025, 0.5, 0.975)).tolist()
            found[stop] = Measured(middle, max(high - low, 0.5 * near))
    return found


def _unknown_growth(
    position: NDArray[np.float64], force: NDArray[np.float64], period: float, near: float
) -> NDArray[np.float64]:
    """Return the growth of the force, N, that proves a stop where F_s − F_c is unknown.

    It is F_c, or twice the largest F_s − F_c of a rest between the ends if that is more. The force
    of viscous friction, or of a lag of the stem, at an arrival is added.
    """
    speed = np.gradient(position, period)
    moving = np.abs(speed) > _MOVING * np.abs(speed).max()
    coulomb, viscous = _friction(position[moving], speed[moving], force[moving])
    growth = max(coulomb, _SURELY * _slip_of_rests(position, force, moving, near, coulomb))
    recent = max(round(_RECENT / period), 1)
    arriving = scipy.ndimage.maximum_filter1d(np.abs(speed), recent, origin=(recent - 1) // 2)
    return growth + viscous * arriving


def _friction(
    position: NDArray[np.float64], speed: NDArray[np.float64], force: NDArray[np.float64]
) -> tuple[float, float]:
    """Return Coulomb (N) and viscous friction (N·s/m) of the moving stem, by least squares.

    A lag of the stem adds to the viscous part. If either is negative, Coulomb friction takes all.
    """
    columns = [position - position.mean(), np.ones(position.size), np.sign(speed), speed]
    (*_, coulomb, viscous), *_ = np.linalg.lstsq(np.column_stack(columns), force, rcond=None)
    if min(coulomb, viscous) >= 0:
        return float(coulomb), float(viscous)
    (*_, loop), *_ = np.linalg.lstsq(np.column_stack(columns[:-1]), force, rcond=None)
    return abs(float(loop)), 0.0


def _slip_of_rests(
    position: NDArray[np.float64],
    force: NDArray[np.float64],
    moving: NDArray[np.bool_],
    near: float,
    coulomb: float,
) -> float:
    """Return the largest F_s − F_c, N, of the rests between the ends; 0 without a rest.

    The force changes by F_s − F_c before the stem moves on, and by F_s + F_c before it reverses.
    """
    low, high = float(np.min(position)) + near, float(np.max(position)) - near
    largest = 0.0
    for begin, end in runs_of(~moving):
        if begin > 0 and end < moving.size and low < position[begin] < high:
            before = position[begin] - position[begin - 1]
            after = position[end] - position[end - 1]
            change = abs(force[end] - force[begin])
            largest = max(largest, change - (2 * coulomb if before * after < 0 else 0.0))
    return largest


def _held(
    below_end: NDArray[np.float64],
    near: float,
    force: NDArray[np.float64],
    least: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return the visits of an end in which the force grows by more than `least` after arrival.

    A visit lasts until the stem is twice as far `below_end` as it was on arrival: noise ends none,
    so that a force which falls and grows again while the stem rests proves no stop. Nothing is
    known of the arrival of a visit with which the record begins.
    """
    held = np.zeros(below_end.size, dtype=np.bool_)
    for first, last in runs_of(below_end < _LEFT * near):
        (there,) = np.nonzero(below_end[first:last] <= near)
        if first == 0 or there.size == 0:
            continue
        begin, end = first + int(there[0]), first + int(there[-1]) + 1
        if np.max(force[begin:end]) - force[begin] > least[begin]:
            held[begin:end] = True
    return held


_FEWEST = 200
_LIKE_WHITE = 1.25
"""Largest ratio of the noise of every second sample to the noise of all samples.

White noise has 1. Above it, the noise is correlated, or the signal itself moves as much from sample
to sample: the number then depends on rate and drive rather than on the sensor."""

_FINEST = 1e-4
"""Share of the signal's range below which noise is indistinguishable from zero."""


def sensor_noises(recording: Recording) -> dict[str, Measured]:
    """Return ``drive_noise`` (Pa or N) and ``stem_noise`` (m), standard deviations.

    A noise that depends on rate or drive is left out. A noise below the resolution, which grows
    with the stroke, has an interval from zero to the resolution.
    """
    if (stamped := recording.stamped) is not None:
        signals = stamped.drive, stamped.position
    elif len(recording) >= _FEWEST:
        time = recording.time
        drive, position = recording.drive, recording.position
        signals = StampedSignal(time, drive), StampedSignal(time, position)
    else:
        return {}
    named = zip(("drive_noise", "stem_noise"), map(_noise, signals), strict=True)
    return {name: noise for name, noise in named if noise is not None}


def _noise(signal: StampedSignal) -> Measured | None:
    fresh = without_repeats(signal)
    if fresh.time.size < _FEWEST:
        return None
    noise = stamped_noise(fresh)
    sparse = stamped_noise(StampedSignal(fresh.time[::2], fresh.value[::2]))
    finest = _FINEST * float(np.ptp(fresh.value))
    if sparse > _LIKE_WHITE * max(noise, finest):
        return None
    if noise < finest:
        return Measured(0.5 * finest, 0.5 * finest)
    chance = 2.0 * noise / math.sqrt(fresh.time.size)
    return Measured(noise, math.hypot(chance, sparse - noise))


SHARED = "sliding_friction_shared"
"""Part of the half width of a sliding friction, N, that other records share as a common error."""

OF_ONE_RESULT = (SHARED, SPEED_EXPONENT)
"""Numbers valid only for the sliding friction of their own result."""

COMPARED = (
    "spring_constant",
    "spring_preload",
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "viscous_asymmetry",
)
"""Parameters of a result that are compared with a baseline."""

IDENTIFIED_ONLY = ("viscous_friction",)
"""Parameters that are compared only where they are identified.

A weak viscous friction cannot be distinguished from a lag or from friction that falls with speed.
It changes with either, and with the motion."""

_COULOMB = "coulomb_friction"
_OF_THE_BALANCE = ("spring_constant", "spring_preload")
_SLIP_SHARE = 0.5
"""Share of a slip force by which it may be wrong, whatever the law of the friction.

Chosen: on simulated valves whose friction falls with speed, 0.4 to 1 of F_s − F_c was found."""

SURE_SPRING = 0.1
"""Largest relative half width of the spring constant at which the numbers of a fit are used.

Chosen. Above it, the record does not separate spring from friction, and all numbers of the fit
depend on both."""


def valve_numbers(result: Result) -> dict[str, Measured]:
    """Return all numbers that a result has measured of the valve, by name, SI units.

    Parameters are included where they are identified or weak (`IDENTIFIED_ONLY` where identified),
    and the preload with any interval. Their intervals leave out the uncertainties of area and
    sensor scales, which two records of the same sensors share. No parameter is included where the
    spring constant is known to worse than 10 %. Where the model does not describe the valve, only
    the slip force, which may be the reason, and an identified spring and preload are included. The
    others are:

    - ``slip_force``, F_s − F_c, N; ``viscous_asymmetry``; ``lag`` of the stem, s;
    - ``lowest_position``, ``highest_position``, and the stops that were met (`stem_reach`);
    - ``drive_noise`` and ``stem_noise`` (`sensor_noises`);
    - the numbers for the comparison of its sliding friction (`comparable_numbers`).
    """
    known = {name: one for name, each in result.parameters.items() if (one := _measured(each))}
    fit = fit_numbers(known)
    if fit:
        fit |= _imperfections(result.evidence, known)
    if result.parameters["viscous_friction"].without_calibration.verdict is not Verdict.IDENTIFIED:
        for name in (*IDENTIFIED_ONLY, "viscous_asymmetry"):  # a share of F_v is known no better
            fit.pop(name, None)
    if result.misfit is not None and not result.misfit.describes:
        balance = {n: result.parameters[n] for n in _OF_THE_BALANCE if n in result.parameters}
        sure = [name for name, one in balance.items() if one.verdict is Verdict.IDENTIFIED]
        fit = {name: one for name, one in fit.items() if name in ("slip_force", *sure)}
    slip = fit.get("slip_force")
    largest = math.nan if slip is None else max(slip.value, 0.0) + slip.half_width
    numbers = sensor_noises(result.recording)
    numbers |= stem_reach(result.recording, result.valve, largest)
    return numbers | fit | comparable_numbers(result.evidence)


def comparable_numbers(evidence: Mapping[str, Any]) -> dict[str, Measured]:
    """Return the numbers of `OF_ONE_RESULT` from the evidence of a result."""
    told = evidence.get(COMPARABLE, {})
    numbers = {}
    if told.get("shared_half_width", 0.0) > 0:
        numbers[SHARED] = Measured(told["shared_half_width"], 0.0)
    if SPEED_EXPONENT in told:
        numbers[SPEED_EXPONENT] = Measured(told[SPEED_EXPONENT], told["half_width"])
    return numbers


def fit_numbers(known: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return the known parameters of `COMPARED`, and ``slip_force``, F_s − F_c.

    The result is empty where the spring constant is not known well enough.
    """
    spring = known.get("spring_constant")
    if spring is None or spring.share > SURE_SPRING:
        return {}
    numbers = {name: known[name] for name in COMPARED if name in known}
    if {"static_friction", "coulomb_friction"} <= known.keys():
        static, coulomb = known["static_friction"], known["coulomb_friction"]
        numbers["slip_force"] = Measured(
            static.value - coulomb.value, static.half_width + coulomb.half_width
        )
    return numbers


def _measured(one: Parameter) -> Measured | None:
    """Return a parameter without its calibration, where it is identified or weak.

    A parameter compared by its difference may well be zero, so an interval wider than the value is
    accepted.
    """
    one = one.without_calibration
    if one.verdict is Verdict.NOT_IDENTIFIABLE and one.name in DIFFERENCES:
        return None if math.isnan(one.magnitude_bound) else Measured(*one.withheld)
    if one.verdict in (Verdict.IDENTIFIED, Verdict.WEAK) and one.half_width >= 0:
        return Measured(one.value, one.half_width)
    return None


def _imperfections(
    evidence: Mapping[str, Any], known: Mapping[str, Measured]
) -> dict[str, Measured]:
    """Return slip force, asymmetry and lag, as the method found them.

    A slip force starts from F_c: the smaller of the half width of F_c and `_SLIP_SHARE` of the slip
    force is added to its interval. Viscous friction delays a sliding stem by (F_v/k)·ẋ, and a lag τ
    shows it late by τ·ẋ. The lag is therefore known no better than F_v/k, and not at all without
    F_v.
    """
    found = {
        name: Measured(one["value"], one["half_width"])
        for name, one in evidence.get(IMPERFECTIONS_FOUND, {}).items()
    }
    if (slip := found.get("slip_force")) is not None:
        share = _SLIP_SHARE * slip.value
        doubt = min(known[_COULOMB].half_width, share) if _COULOMB in known else share
        found["slip_force"] = Measured(slip.value, math.hypot(slip.half_width, doubt))
    if (lag := found.pop("lag", None)) is not None and "viscous_friction" in known:
        doubt = known["viscous_friction"].half_width / known["spring_constant"].value
        found["lag"] = Measured(lag.value, math.hypot(lag.half_width, doubt))
    return found


class RefusedRecordError(RefusalError):
    """A refusal, with the numbers that its record shows nevertheless.

    Attributes
    ----------
    numbers : mapping of str to Measured
        Numbers of the valve by name, SI units (`numbers_of_refused`).
    is_fault : bool
        Whether the record is unusable, rather than short of motion.
    """

    def __init__(
        self, message: str, numbers: Mapping[str, Measured], is_fault: bool = True
    ) -> None:
        super().__init__(message)
        self.numbers, self.is_fault = numbers, is_fault

    @classmethod
    def of(cls, refusal: RefusalError, numbers: Mapping[str, Measured]) -> "RefusedRecordError":
        """Return a refusal with numbers; too little motion is not a fault of the record."""
        return cls(str(refusal), numbers, not isinstance(refusal, LittleMotionError))

    def __reduce__(self) -> tuple[object, ...]:
        """Support pickling with all arguments."""
        return type(self), (str(self), self.numbers, self.is_fault)


def numbers_of_refused(
    recording: Recording, valve: Valve, settings: IdentificationSettings
) -> dict[str, Measured]:
    """Return sensor noises and ends of the stem's motion from a refused record.

    Signals of an impossible size give nothing. The ends of the motion require a stem that moved
    both ways and with the drive.
    """
    numbers: dict[str, Measured] = {}
    with contextlib.suppress(RefusalError, ValueError):
        require_drive(recording, valve)
        require_plausible_units(recording, valve, settings)
        require_within_travel(recording, valve)
        numbers |= sensor_noises(recording)
        require_motion(recording, valve.travel)
        require_two_directions(recording, settings.published_window, valve.travel)
        require_travel(recording, valve)
        require_related_signals(recording)
        numbers |= stem_reach(recording, valve, math.nan)
    return numbers
