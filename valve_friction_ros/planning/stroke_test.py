"""Stroke tests: patterns of strokes, and the corners of the pressure that they come to."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_non_negative
from valve_friction_ros.model.excitations import SampledPressure
from valve_friction_ros.planning.pressure_band import PressureBand

__all__ = ["FEWEST_CYCLES", "SHAPES", "Pattern", "StrokeTest", "stroke_test"]

SHAPES = {
    "full": (1.0, 0.0),
    "turning": (1.0, 0.4, 1.0, 0.0, 0.6, 0.0),
    "stairs": (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0),
}
"""Levels that a cycle goes to in turn, shares of the band; each cycle begins at the lower end.

A full stroke slides longest; one that turns on its way breaks away more often; stairs stop and
start again in the same direction."""

FEWEST_CYCLES = 2
"""Cycles in a test: three strokes and more give a number a verdict better than weak."""

_MIDDLE = 0.5
_BEFORE = 1.0
"""Level, share of the band, and time, s, for which a test holds it before the first stroke."""

_SHORTEST_HOLD = 1e-3
"""Holds up to this, s, are left out: their corners would not differ in the file."""


@dataclass(frozen=True)
class Pattern:
    """What repeats in a stroke test; cycle after cycle takes the next shape and the next speed.

    Attributes
    ----------
    shapes : tuple of str
        Names of `SHAPES`.
    speeds : tuple of float
        Rates of the pressure, shares of the largest one, above 0 and at most 1.
    hold : float
        Time at each level, s.

    Raises
    ------
    ValueError
        If it is no pattern.
    """

    shapes: tuple[str, ...]
    speeds: tuple[float, ...]
    hold: float

    def __post_init__(self) -> None:
        """Refuse what is no pattern."""
        if not self.shapes or not set(self.shapes) <= set(SHAPES):
            raise ValueError(f"shapes must be of {', '.join(SHAPES)}, got {self.shapes}")
        if not self.speeds or not all(0 < one <= 1 for one in self.speeds):
            raise ValueError(f"speeds must lie above 0 and at most at 1, got {self.speeds}")
        require_non_negative("hold", self.hold)

    def cycles(self) -> Iterator[tuple[tuple[float, ...], float]]:
        """Yield levels and speed of each cycle, without end."""
        shapes = itertools.cycle(self.shapes)
        speeds = itertools.cycle(self.speeds)
        for shape, speed in zip(shapes, speeds, strict=False):
            yield SHAPES[shape], speed

    @property
    def kinds(self) -> int:
        """Cycles until the pattern repeats, at least `FEWEST_CYCLES`."""
        return max(len(self.shapes), len(self.speeds), FEWEST_CYCLES)


@dataclass(frozen=True, eq=False)
class StrokeTest:
    """The pressure of a stroke test: linear between corners.

    Attributes
    ----------
    times : ndarray of float, shape (n,)
        Since the start, s.
    pressures : ndarray of float, shape (n,)
        Pressure at these times, Pa.
    pattern : Pattern
        Its pattern.
    cycles : int
        How often the stem goes up and down again.
    """

    times: NDArray[np.float64] = field(repr=False)
    pressures: NDArray[np.float64] = field(repr=False)
    pattern: Pattern
    cycles: int

    @property
    def duration(self) -> float:
        """Length, s."""
        return float(self.times[-1])

    @property
    def largest_rate(self) -> float:
        """Largest rate of the pressure, Pa/s."""
        return float(np.max(np.abs(np.diff(self.pressures) / np.diff(self.times))))

    @property
    def excitation(self) -> SampledPressure:
        """The pressure before the converter, as a signal."""
        return SampledPressure(self.times, self.pressures)


def _cycle_time(levels: tuple[float, ...], speed: float, hold: float, span_time: float) -> float:
    moved = sum(abs(after - before) for before, after in itertools.pairwise((0.0, *levels)))
    return moved * span_time / speed + hold * len(levels)


def stroke_test(pattern: Pattern, band: PressureBand, duration: float) -> StrokeTest | None:
    """Return the test of a pattern that lasts at most `duration` s; None if that is too short.

    It begins and ends with a hold at the middle pressure of the band, where the stem rests on that
    side of its middle from which it came. Each of its kinds of cycles is there.
    """
    span_time = (band.high - band.low) / band.rate
    ends = _BEFORE + 2 * (_MIDDLE * span_time + pattern.hold)
    left = duration - ends
    steps = [(0.0, 1.0)]
    count = 0
    for levels, speed in pattern.cycles():
        needed = _cycle_time(levels, speed, pattern.hold, span_time)
        if needed > left + 1e-9:
            break
        left -= needed
        count += 1
        steps += [(level, speed) for level in levels]
    if count < pattern.kinds:
        return None
    steps.append((_MIDDLE, 1.0))
    times, shares = [0.0, _BEFORE], [_MIDDLE, _MIDDLE]
    for level, speed in steps:
        times.append(times[-1] + abs(level - shares[-1]) * span_time / speed)
        shares.append(level)
        if pattern.hold > _SHORTEST_HOLD:
            times.append(times[-1] + pattern.hold)
            shares.append(level)
    pressures = band.low + (band.high - band.low) * np.array(shares)
    return StrokeTest(np.array(times), pressures, pattern, count)
