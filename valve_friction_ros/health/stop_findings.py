"""Travel stops that have moved since the baseline."""

from collections.abc import Iterator, Mapping

from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_changes import Change, difference
from valve_friction_ros.model.valve import Valve

__all__ = ["stop_findings"]

_SIDES = {
    "lower_stop": ("lowest_position", -1.0, "lower end"),
    "upper_stop": ("highest_position", 1.0, "upper end"),
}


def stop_findings(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured], valve: Valve, share: float
) -> Iterator[Finding]:
    """Find stops that have surely moved by more than a share of the travel.

    A stop that only the present record met is compared with how far the stem went in that of the
    baseline: where it went further, travel has been lost. Where the stem has gone beyond a stop of
    the baseline, that has moved outward. A stop that has stayed excludes the zero of the position
    sensor for the other, and leaves its span; where only one was met, it may be either.
    """
    bound = share * valve.travel
    moved = _moved(now, healthy, bound)
    changes = list(moved.values())
    if len(changes) == len(_SIDES) and changes[0].agrees_with(changes[1]):
        yield _finding(
            f"both travel stops have moved alike, by {_millimetres(changes[0])}: the zero of the "
            "position sensor or its coupling to the stem has moved: check its mounting",
            *moved,
        )
        return
    sensor = "zero and span" if len(moved) == len(_SIDES) else "zero or span"
    if any(name in now and name in healthy for name in _SIDES.keys() - moved.keys()):
        sensor = "span"
    for name, change in moved.items():
        end, side, words = _SIDES[name]
        if side * change.value < 0:
            yield _finding(
                f"travel is lost at its {words}: the stem stops {_millimetres(change)} from where "
                "it went before: check for dirt or a part in the trim, a stop that was set, and "
                f"the {sensor} of the position sensor",
                name,
            )
        else:
            yield _finding(
                f"the travel stop at its {words} has moved outward by {_millimetres(change)}: "
                f"check seat and plug for wear, stop and coupling, and the {sensor} of the "
                "position sensor",
                name if name in now else end,
            )


def _moved(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured], bound: float
) -> dict[str, Change]:
    """Return the changes of the stops that have surely moved by more than a bound, m."""
    moved = {}
    for name, (end, side, _) in _SIDES.items():
        if name not in now:
            if end in now and name in healthy:
                change = difference(now[end], healthy[name])
                if change.times(side).beyond(-float("inf"), bound):
                    moved[name] = change
        elif name in healthy:
            change = difference(now[name], healthy[name])
            if change.beyond(-bound, bound):
                moved[name] = change
        elif end in healthy:
            change = difference(now[name], healthy[end])
            if change.times(side).beyond(-bound, float("inf")):
                moved[name] = change
    return moved


def _finding(message: str, *numbers: str) -> Finding:
    return Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, message, numbers)


def _millimetres(change: Change) -> str:
    change = change.times(1e3)
    return f"{change.value:+.2f} mm ({change.low:+.2f} to {change.high:+.2f})"
