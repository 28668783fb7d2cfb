"""One factor by which spring and friction have changed alike: a scale, rather than the valve."""

from collections.abc import Mapping
from dataclasses import replace

from valve_friction_ros.health.diagnosis import Diagnosis
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.health.valve_changes import Change
from valve_friction_ros.health.valve_limits import ValveLimits
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.valve import Valve

__all__ = ["common_factor", "drive_scale", "explains", "qualified", "spring_change"]

_COMMON_SHARE = 0.3
"""Share by which the upper end of a ratio may lie above the lower, to speak for a common factor."""


def drive_scale(valve: Valve) -> str:
    """Return what scales all forces of a valve alike, in words."""
    area = " and the diaphragm area" if valve.driven_by is Drive.PRESSURE else ""
    return f"the scale of the {valve.driven_by.words} sensor{area}"


def spring_change(changes: Mapping[str, Change], limits: ValveLimits) -> Change | None:
    """Return the ratio of the spring constants where it is surely beyond its bound."""
    change, share = changes.get("spring_constant"), limits.spring_change
    return change if change is not None and change.beyond(1 - share, 1 + share) else None


def common_factor(changes: Mapping[str, Change], limits: ValveLimits) -> Change | None:
    """Return the factor by which all forces have changed, as by another scale of the drive.

    None where the spring constant has not surely changed, or the frictions not by its factor.
    """
    spring, coulomb = spring_change(changes, limits), changes.get("coulomb_friction")
    if spring is None or coulomb is None or coulomb.holds(1.0) or not _is_narrow(coulomb):
        return None
    others = [changes.get(name) for name in ("static_friction", "viscous_friction")]
    known = [one for one in others if one is not None and _is_narrow(one)]
    return spring if all(one.agrees_with(spring) for one in (coulomb, *known)) else None


def _is_narrow(ratio: Change) -> bool:
    """Return whether a ratio is known well enough to speak for a common factor."""
    return ratio.low > 0 and ratio.high / ratio.low < 1 + _COMMON_SHARE


def explains(factor: Change | None, diagnosis: Diagnosis) -> bool:
    """Return whether a common factor explains what a diagnosis finds on the friction."""
    ratio = diagnosis.ratio
    if factor is None or ratio is None or diagnosis.level < Level.WARN:
        return False
    return Change(ratio.value, ratio.low, ratio.high).agrees_with(factor)


def qualified(diagnosis: Diagnosis, factor: Change | None, valve: Valve) -> Diagnosis:
    """Return a diagnosis that says so where a common factor explains what it finds.

    The level stays, as nothing proves that the friction is healthy; the signal is to check the
    function.
    """
    words = (
        "friction and spring constant have changed by one factor, which points to "
        f"{drive_scale(valve)}: check them before any work on the packing; "
    )
    if not explains(factor, diagnosis) or diagnosis.message.startswith(words):
        return diagnosis
    return replace(
        diagnosis, status_signal=StatusSignal.CHECK_FUNCTION, message=words + diagnosis.message
    )
