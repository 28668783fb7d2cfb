# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Changes of a valve besides its friction: limits, what to check, and the newest measurements."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

from valve_friction_ros.health.alarm_conditions import farthest
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits, diagnose
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import (
    DatedNumber,
    Measured,
    difference,
    ratio_of,
    valve_changes,
)
from valve_friction_ros.health.valve_numbers import valve_numbers
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.trust.stated import is_atmosphere
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import Code, Statement, said


@dataclass(frozen=True)
class ValveLimits:
    """Bounds of the changes of a valve besides its friction (`FrictionLimits`).

    A bound is exceeded only when the whole interval of the change lies beyond it.

    Attributes
    ----------
    spring_change, spring_failure : float
        Changes of the spring constant, as shares, for maintenance and for a failure.
    preload_change : float
        Shift of the balance, as a share of the spring's force over the travel.
    slip_change : float
        Growth of the slip jump (F_s − F_c)/k, as a share of the travel.
    viscous_factor : float
        Factor of change of the viscous friction, up or down.
    asymmetry_change : float
        Change of the share by which viscous friction is larger upward.
    stop_change : float
        Shift of a travel stop, as a share of the travel.
    noise_factor : float
        Factor of growth of the noise of a sensor.
    lag_change : float
        Change of the lag of the stem behind the pressure, s.

    Raises
    ------
    ValueError
        If a limit is not positive, a factor is not above 1, or the spring limits are reversed.

    Notes
    -----
    No standard gives such bounds; the defaults are chosen. Springs keep their constant within a few
    percent for decades, so 15 % is a fault of spring or scale, and 30 % is one spring out of three.
    3 % of the balance is above the drift of industrial sensors and below the usual margin of a
    bench set. A slip jump larger by 1 % of the travel equals the common steps of a loop. With a
    stop moved by 2 %, the valve no longer shuts or opens as before. Viscous friction trades with
    the lag and changes with temperature, so its limit is a factor of 2.
    """

    spring_change: float = 0.15
    spring_failure: float = 0.30
    preload_change: float = 0.03
    slip_change: float = 0.01
    viscous_factor: float = 2.0
    asymmetry_change: float = 0.2
    stop_change: float = 0.02
    noise_factor: float = 2.0
    lag_change: float = 0.02

    def __post_init__(self) -> None:
        for name in (one.name for one in fields(self)):
            least = 1.0 if name.endswith("factor") else 0.0
            if not (value := getattr(self, name)) > least:
                raise ValueError(f"{name} must be above {least:g}, got {value:g}")
        if not self.spring_change < self.spring_failure < 1:
            raise ValueError(
                "limits must satisfy spring_change < spring_failure < 1, got spring_change "
                f"{self.spring_change:g}, spring_failure {self.spring_failure:g}"
            )


class ValveDiagnosis(NamedTuple):
    """Diagnosis of the friction of a valve, and its other findings."""

    friction: Diagnosis
    findings: tuple[Finding, ...]


def diagnose_valve(
    result: Result, baseline: Baseline | None, limits: FrictionLimits | None = None
) -> ValveDiagnosis:
    """Compare friction (`diagnose`) and other numbers of a result with the baseline.

    The diagnosis of the friction states if a common factor explains both friction and spring. There
    are no other findings without a baseline, or with a baseline of friction alone.
    """
    friction = diagnose(result, result.valve, baseline, limits)
    if baseline is None or not baseline.numbers:
        return ValveDiagnosis(friction, ())
    numbers = valve_numbers(result)
    factor = common_factor(valve_changes(numbers, baseline.numbers), ValveLimits())
    return ValveDiagnosis(
        qualified(friction, factor, result.valve),
        diagnose_numbers(numbers, baseline, result.valve),
    )


def diagnose_numbers(
    numbers: Mapping[str, Measured],
    baseline: Baseline,
    valve: Valve,
    limits: ValveLimits | None = None,
) -> tuple[Finding, ...]:
    """Compare the numbers of a valve with its baseline.

    Parameters
    ----------
    numbers : mapping of str to Measured
        Present numbers of the valve (`valve_numbers`).
    baseline : Baseline
        The healthy valve.
    valve : Valve
        Gives travel, area and drive.
    limits : ValveLimits, optional
        Bounds of the changes.

    Returns
    -------
    tuple of Finding
        A finding for each change clearly beyond its bound, with what to check. A number that either
        side lacks is not compared. A finding names all causes that a record cannot tell
        apart, except those that another number excludes.
    """
    case = _Case(
        numbers,
        baseline.numbers,
        valve_changes(numbers, baseline.numbers),
        valve,
        limits or ValveLimits(),
    )
    factor = common_factor(case.changes, case.limits)
    return (
        *(_spring(case) if factor is None else _common_scale(case, factor)),
        *_slip(case, factor),
        *_viscous(case, factor),
        *_preload(case),
        *_asymmetry(case),
        *_stops(case),
        *_noises(case, has_scaled=factor is not None),
        *_lag(case),
    )


@dataclass(frozen=True)
class _Case:
    """Present and baseline numbers, with their changes."""

    now: Mapping[str, Measured]
    healthy: Mapping[str, Measured]
    changes: Mapping[str, Measured]
    valve: Valve
    limits: ValveLimits

    @property
    def spring_force(self) -> float:
        """Force of the healthy spring over the travel, N; nan where either is unknown."""
        spring = self.healthy.get("spring_constant")
        if spring is None or not math.isfinite(self.valve.travel):
            return math.nan
        return spring.value * self.valve.travel

    @property
    def drive(self) -> str:
        """The name of the drive."""
        return self.valve.driven_by.name


def _maintenance(statement: Statement, *numbers: str) -> Finding:
    return Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, statement, numbers)


def _check(statement: Statement, *numbers: str) -> Finding:
    return Finding(Level.WARN, StatusSignal.CHECK_FUNCTION, statement, numbers)


def _common_scale(case: _Case, factor: Measured) -> Iterator[Finding]:
    """Find that all forces have changed by a common factor, as if the scale of the drive changed.

    A change as large as a spring failure remains an ERROR: nothing proves that the spring is sound.
    """
    share = case.limits.spring_failure
    found = _check(
        said(Code.COMMON_SCALE, change=factor.interval, scale=drive_scale(case.valve)),
        "spring_constant",
        "coulomb_friction",
    )
    yield replace(found, level=Level.ERROR) if factor.beyond(1 - share, 1 + share) else found


def _spring(case: _Case) -> Iterator[Finding]:
    change = _spring_change(case.changes, case.limits)
    if change is None:
        return
    share, value = case.limits.spring_failure, case.now["spring_constant"].value
    coulomb, preload = case.changes.get("coulomb_friction"), _preload_ratio(case)
    causes = [] if _is_scale_excluded(case, change) else [said(Code.POSITION_SCALE)]
    if coulomb is None or coulomb.agrees_with(change):
        causes.append(drive_scale(case.valve))
    statement = said(
        Code.SPRING_CHANGED,
        with_preload=preload is not None and preload.agrees_with(change),
        change=change.interval,
        value=value,
        causes=tuple(causes),
    )
    if change.beyond(1 - share, 1 + share):
        yield Finding(Level.ERROR, StatusSignal.FAILURE, statement, ("spring_constant",))
    else:
        yield _maintenance(statement, "spring_constant")


def _is_scale_excluded(case: _Case, spring: Measured) -> bool:
    """Return whether the distance of the stops excludes a new scale of the position sensor.

    A scale s multiplies the distance by s and the spring constant by 1/s.
    """
    if not {"lower_stop", "upper_stop"} <= case.changes.keys():
        return False
    now, healthy = (
        difference(side["upper_stop"], side["lower_stop"]) for side in (case.now, case.healthy)
    )
    if min(now.low, healthy.low, spring.low) <= 0:
        return False
    widths = (0.5 * (one.high - one.low) / one.value for one in (now, healthy))
    span, spread = now.value / healthy.value, math.hypot(*widths)
    expected = Measured.between(1 / spring.value, 1 / spring.high, 1 / spring.low)
    return not Measured.between(span, span * (1 - spread), span * (1 + spread)).agrees_with(
        expected
    )


def _preload_ratio(case: _Case) -> Measured | None:
    """Return the ratio of the preloads, where both are clearly above zero."""
    now, healthy = (side.get("spring_preload") for side in (case.now, case.healthy))
    if now is None or healthy is None:
        return None
    if min(now.value - now.half_width, healthy.value - healthy.half_width) <= 0:
        return None
    return ratio_of(now, healthy)


def _preload(case: _Case) -> Iterator[Finding]:
    shift, bound = case.changes.get("spring_preload"), case.spring_force
    bound *= case.limits.preload_change
    if shift is None or not shift.beyond(-bound, bound):
        return
    spring, ratio = _spring_change(case.changes, case.limits), _preload_ratio(case)
    if spring is not None and ratio is not None and ratio.agrees_with(spring):
        return  # the same spring, as far compressed as before
    statement = said(
        Code.BALANCE_SHIFTED,
        change=shift.interval,
        share=abs(shift.value) / case.spring_force,
        causes=_preload_causes(case, shift),
    )
    yield _maintenance(statement, "spring_preload")


def _preload_causes(case: _Case, shift: Measured) -> tuple[Statement, ...]:
    """Return the possible causes of a shift of the balance that no other number excludes.

    A pressure reading too high by e adds A·e to the preload. A position reading too high by b
    subtracts k·b.
    """
    stiffness = case.healthy["spring_constant"].value
    moved = shift.times(-1.0 / stiffness)
    stops = [case.changes[name] for name in ("lower_stop", "upper_stop") if name in case.changes]
    bound = case.limits.stop_change * case.valve.travel
    with_balance = [one.agrees_with(moved) for one in stops]
    have_moved = all(with_balance) and all(one.beyond(-bound, bound) for one in stops)
    if have_moved and len(stops) == len(_SIDES):
        return (said(Code.POSITION_ZERO, reading=moved.value, stops="BOTH"),)
    drive = case.valve.driven_by
    zero_of_drive = case.valve.actuator_drive(shift.value) - case.valve.actuator_drive(0.0)
    reading = zero_of_drive / drive.size
    is_air = drive is Drive.PRESSURE and is_atmosphere(zero_of_drive)
    causes = [
        *([said(Code.AIR_PRESSURE)] if is_air else ()),
        said(Code.BENCH_SET),
        said(Code.DRIVE_ZERO, drive=drive.name, reading=reading, unit=drive.unit),
    ]
    if all(with_balance):
        met = "ONE" if have_moved and stops else "NONE"
        causes.append(said(Code.POSITION_ZERO, reading=moved.value, stops=met))
    friction = case.now.get("coulomb_friction")
    if friction is None or min(abs(shift.low), abs(shift.high)) < friction.value:
        causes.append(said(Code.UNEVEN_PACKING, upward=shift.value > 0))
    return tuple(causes)


def _slip(case: _Case, factor: Measured | None) -> Iterator[Finding]:
    """Find growth of the slip jump, unless a common factor of all forces explains it."""
    growth, bound = case.changes.get("slip_force"), case.limits.slip_change * case.spring_force
    if growth is None or not growth.low > bound:
        return
    healthy = case.healthy["slip_force"].value
    if factor is not None and growth.low <= healthy * (factor.high - 1):
        return
    jump = case.now["slip_force"].value / case.spring_force
    yield _maintenance(said(Code.SLIP_GROWN, change=growth.interval, share=jump), "slip_force")


def _viscous(case: _Case, factor: Measured | None) -> Iterator[Finding]:
    """Find a change of viscous friction, unless a common factor of all forces explains it."""
    ratio, bound = case.changes.get("viscous_friction"), case.limits.viscous_factor
    way = 0 if ratio is None else ratio.beyond(1 / bound, bound)
    is_explained = factor is not None and ratio is not None and ratio.agrees_with(factor)
    if ratio is not None and way and not is_explained:
        statement = said(Code.VISCOUS_CHANGED, grown=way > 0, change=ratio.interval)
        yield _maintenance(statement, "viscous_friction")


def _asymmetry(case: _Case) -> Iterator[Finding]:
    change, bound = case.changes.get("viscous_asymmetry"), case.limits.asymmetry_change
    if change is not None and change.beyond(-bound, bound):
        upward, interval = change.value > 0, change.interval
        statement = said(Code.ASYMMETRY_CHANGED, upward=upward, change=interval)
        yield _maintenance(statement, "viscous_asymmetry")


_SIDES = {
    "lower_stop": ("lowest_position", -1.0),
    "upper_stop": ("highest_position", 1.0),
}


def _stops(case: _Case) -> Iterator[Finding]:
    """Find stops that have clearly moved by more than their share of the travel.

    A stop that only the present record met is compared with the range of motion of the baseline: if
    the baseline went farther, travel is lost. A baseline stop that the stem has now passed has
    moved outward. If the other stop has not moved, the zero of the position sensor is excluded as a
    cause, and its span remains. If only this stop is comparable, either may be the cause.
    """
    moved = _moved(case)
    changes = list(moved.values())
    if len(changes) == len(_SIDES) and changes[0].agrees_with(changes[1]):
        yield _maintenance(said(Code.STOPS_MOVED_ALIKE, change=changes[0].interval), *moved)
        return
    sensor = "BOTH" if len(moved) == len(_SIDES) else "EITHER"
    if any(name in case.now and name in case.healthy for name in _SIDES.keys() - moved.keys()):
        sensor = "SPAN"
    for name, change in moved.items():
        end, side = _SIDES[name]
        is_lost = side * change.value < 0
        code = Code.TRAVEL_LOST if is_lost else Code.STOP_MOVED_OUTWARD
        statement = said(code, stop=name, change=change.interval, sensor=sensor)
        yield _maintenance(statement, name if is_lost or name in case.now else end)


def _moved(case: _Case) -> dict[str, Measured]:
    """Return the changes of the stops that have clearly moved by more than their bound, m."""
    bound = case.limits.stop_change * case.valve.travel
    moved = {}
    for name, (end, side) in _SIDES.items():
        now, healthy = case.now.get(name), case.healthy.get(name)
        low, high = -bound, bound
        if now is None:  # only a stem beyond the healthy stop shows that it has moved
            now, low = case.now.get(end), -math.inf
        elif healthy is None:  # only a stop short of the healthy way
            healthy, high = case.healthy.get(end), math.inf
        if now is not None and healthy is not None:
            change = difference(now, healthy)
            if change.times(side).beyond(low, high):
                moved[name] = change
    return moved


def _noises(case: _Case, has_scaled: bool) -> Iterator[Finding]:
    """Find growth of noise, unless a new scale of the drive explains the noise of the drive."""
    signals = {"drive_noise": case.drive, "stem_noise": "STEM"}
    for name, signal in signals.items():
        ratio = case.changes.get(name)
        if ratio is None or not ratio.low > case.limits.noise_factor:
            continue
        is_scale = has_scaled and ratio.agrees_with(case.changes["spring_constant"])
        if not (is_scale and name == "drive_noise"):
            grown = said(Code.NOISE_GROWN, signal=signal, change=ratio.interval)
            yield _check(grown, name)


def _lag(case: _Case) -> Iterator[Finding]:
    change, bound = case.changes.get("lag"), case.limits.lag_change
    if change is None or not change.beyond(-bound, bound):
        return
    later, interval = change.value > 0, change.interval
    yield _check(said(Code.LAG_CHANGED, later=later, drive=case.drive, change=interval), "lag")


_COMMON_SHARE = 0.3
"""Largest excess of the upper end of a ratio over the lower, as a share, for a common factor."""


def drive_scale(valve: Valve) -> Statement:
    """Return the quantities that scale all forces of a valve."""
    code = Code.AREA_AND_SCALE if valve.driven_by is Drive.PRESSURE else Code.SCALE
    return said(code, drive=valve.driven_by.name)


def _spring_change(changes: Mapping[str, Measured], limits: ValveLimits) -> Measured | None:
    """Return the ratio of the spring constants where it is clearly beyond its bound."""
    change, share = changes.get("spring_constant"), limits.spring_change
    return change if change is not None and change.beyond(1 - share, 1 + share) else None


def common_factor(changes: Mapping[str, Measured], limits: ValveLimits) -> Measured | None:
    """Return the common factor of change of all forces, as if the scale of the drive changed.

    Return None if the spring constant has not clearly changed, or the frictions not by its factor.
    """
    spring, coulomb = _spring_change(changes, limits), changes.get("coulomb_friction")
    if spring is None or coulomb is None or coulomb.holds(1.0) or not _is_narrow(coulomb):
        return None
    others = [changes.get(name) for name in ("static_friction", "viscous_friction")]
    known = [one for one in others if one is not None and _is_narrow(one)]
    return spring if all(one.agrees_with(spring) for one in (coulomb, *known)) else None


def _is_narrow(ratio: Measured) -> bool:
    """Return whether a ratio is known well enough to support a common factor."""
    return ratio.low > 0 and ratio.high / ratio.low < 1 + _COMMON_SHARE


def explains(factor: Measured | None, diagnosis: Diagnosis) -> bool:
    """Return whether a common factor explains the change of friction in a diagnosis."""
    ratio = diagnosis.ratio
    if factor is None or ratio is None or diagnosis.level < Level.WARN:
        return False
    return ratio.agrees_with(factor)


def qualified(diagnosis: Diagnosis, factor: Measured | None, valve: Valve) -> Diagnosis:
    """Return a diagnosis that states if a common factor explains its finding.

    The level stays, as nothing proves that the friction is healthy. The status signal becomes
    "check function".
    """
    if not explains(factor, diagnosis) or diagnosis.statement.code is Code.SCALED:
        return diagnosis
    statement = said(Code.SCALED, scale=drive_scale(valve), of=diagnosis.statement)
    return replace(diagnosis, status_signal=StatusSignal.CHECK_FUNCTION, statement=statement)


_ENDS_AND_STOPS = (("lowest_position", "lower_stop", -1.0), ("highest_position", "upper_stop", 1.0))


@dataclass(frozen=True)
class KnownNumbers:
    """The newest measurement of each number of a valve.

    A record that does not show a number leaves its earlier value: nothing was repaired.

    Attributes
    ----------
    dated : mapping of str to DatedNumber
        The numbers by name.
    latest : int or None
        Time of the latest record, ns; None without one.
    """

    dated: Mapping[str, DatedNumber] = field(default_factory=dict)
    latest: int | None = None

    @property
    def numbers(self) -> dict[str, Measured]:
        """The numbers, whatever their age."""
        return {name: one.number for name, one in self.dated.items()}

    @property
    def of_latest(self) -> dict[str, Measured]:
        """The numbers of the latest record alone."""
        return {n: one.number for n, one in self.dated.items() if one.time == self.latest}

    def only_latest(self) -> "KnownNumbers":
        """Return the numbers of the latest record alone."""
        return KnownNumbers(
            {name: one for name, one in self.dated.items() if one.time == self.latest}, self.latest
        )

    def since(self, time: int | None) -> "KnownNumbers":
        """Return the numbers measured at a time, ns, or later; all for None."""
        kept = {name: one for name, one in self.dated.items() if time is None or one.time >= time}
        return KnownNumbers(kept, self.latest)

    def followed_by(self, numbers: Mapping[str, Measured], time: int) -> "KnownNumbers":
        """Return the numbers after a further record.

        A stop is dropped once the stem has clearly passed it. The farthest position stays until
        a record shows a stop, or a position at least as far.
        """
        dated = dict(self.dated)
        fresh = dict(numbers)
        for end, stop, side in _ENDS_AND_STOPS:
            if end not in fresh or stop in fresh:
                continue
            now, met, farthest = fresh[end], dated.get(stop), dated.get(end)
            if met and side * (now.value - met.value) > now.half_width + met.half_width:
                del dated[stop]
            if farthest and not side * (now.value - farthest.value) >= 0:
                del fresh[end]
        dated |= {n: DatedNumber(time, one.value, one.half_width) for n, one in fresh.items()}
        return KnownNumbers(dated, time)

    def common_factor(
        self, baseline: Baseline | None, limits: ValveLimits | None = None
    ) -> Measured | None:
        """Return the common factor of change of spring and friction (`common_factor`)."""
        if baseline is None:
            return None
        return common_factor(valve_changes(self.numbers, baseline.numbers), limits or ValveLimits())

    def with_record(self, numbers: Mapping[str, Measured], time: int) -> "KnownNumbers":
        """Return the numbers after inserting a record that may be older than others."""
        known = KnownNumbers({n: one for n, one in self.dated.items() if one.time < time})
        known = known.followed_by(numbers, time)
        for later in sorted({one.time for one in self.dated.values() if one.time > time}):
            known = known.followed_by(
                {n: one.number for n, one in self.dated.items() if one.time == later}, later
            )
        return known

    def findings(
        self, baseline: Baseline | None, valve: Valve, limits: ValveLimits | None = None
    ) -> tuple[Finding, ...]:
        """Return the changes since a baseline (`diagnose_numbers`).

        A finding that rests on a number of an earlier record states its date.
        """
        if baseline is None or not baseline.numbers:
            return ()
        found = diagnose_numbers(self.numbers, baseline, valve, limits)
        return tuple(map(self._with_date, found))

    def may_differ(
        self, baseline: Baseline, valve: Valve, limits: ValveLimits | None = None
    ) -> bool:
        """Return whether the far ends of the intervals show a change (`farthest`).

        An alarm on the whole valve clears only once they show none.
        """
        numbers = farthest(self.numbers, baseline.numbers)
        return bool(diagnose_numbers(numbers, baseline, valve, limits))

    def _with_date(self, finding: Finding) -> Finding:
        times = {self.dated[name].time for name in finding.numbers if name in self.dated}
        if not times - {self.latest}:
            return finding
        dated = said(Code.MEASURED_EARLIER, of=finding.statement, time=min(times))
        return replace(finding, statement=dated)
