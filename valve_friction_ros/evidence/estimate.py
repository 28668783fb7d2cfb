"""The evidence of a ledger of moves: friction since it last changed, and that change."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.balance import (
    FEWEST_BLOCKS,
    FEWEST_MOVES,
    MOST_BLOCKS,
    Balance,
    balance_of,
)
from valve_friction_ros.evidence.blocks import blocks_of
from valve_friction_ros.evidence.changes import Split, last_splits
from valve_friction_ros.evidence.design import ALONG, PRELOAD, SLIDING, SPEED, SPRING, STATIC
from valve_friction_ros.evidence.moves import Move, Moves
from valve_friction_ros.evidence.series import series_of
from valve_friction_ros.identification import (
    TIMING_UNCERTAINTY,
    IdentificationSettings,
    Parameter,
)
from valve_friction_ros.identification.trust.calibration import calibrated, calibration_share
from valve_friction_ros.identification.trust.rounding import percentage
from valve_friction_ros.identification.trust.verdict import (
    WEAK_SHARE,
    Verdict,
    fixed,
    not_identifiable,
    with_verdict,
)
from valve_friction_ros.model.valve import Valve

__all__ = ["MOST_MOVES", "Change", "Evidence", "evidence_of"]

MOST_MOVES = 4096
"""Moves of a ledger that are worth keeping: some half a day of a valve that never rests, or weeks
of a quiet one. Chosen: they are combined in under 0.1 s."""

_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
    "sliding_friction",
    "dead_band",
)
_VAGUEST_SPRING = 0.25
"""Half width of the spring constant, as a share of it, beyond which there is no dead band.

Chosen: moves over some tenths of the travel know it to ±4 %, moves that hardly leave their place to
±50 %; friction that bends with the speed then moves the dead band by 10 %."""

_MEAN_SLOPE = "the change of friction with speed among moves, by whatever law"
_COULOMB = "moves in service do not split friction into F_c and F_v"


@dataclass(frozen=True)
class Change:
    """A declared change of friction.

    Attributes
    ----------
    earliest, latest : int
        Interval of its time, ns since 1970 (UTC).
    ratio, low, high : float
        Sliding friction after it over that before it, with its interval.
    """

    earliest: int
    latest: int
    ratio: float
    low: float
    high: float


@dataclass(frozen=True)
class Evidence:
    """What the moves since the last change of friction say together.

    Attributes
    ----------
    moves : int
        Moves that are used.
    since, until : int
        Begin of the first one and end of the last one, ns since 1970 (UTC); 0 without any.
    parameters : mapping of str to Parameter
        ``sliding_friction``, ``static_friction``, ``spring_constant``, ``spring_preload``,
        ``viscous_friction``, ``dead_band`` (m), and ``coulomb_friction``, which moves in service
        do not determine.
    sliding_speed : float
        Speed that the sliding friction belongs to, m/s.
    changes : tuple of Change
        The declared changes that the ledger still shows, oldest first.
    """

    moves: int
    since: int
    until: int
    parameters: Mapping[str, Parameter]
    sliding_speed: float = math.nan
    changes: tuple[Change, ...] = ()
    values: Mapping[str, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Give the values of the parameters by name."""
        values = {name: one.value for name, one in self.parameters.items()}
        object.__setattr__(self, "values", values)

    @property
    def change(self) -> Change | None:
        """The last declared change that the ledger still shows."""
        return self.changes[-1] if self.changes else None

    @property
    def is_known(self) -> bool:
        """Whether there is a sliding friction."""
        return math.isfinite(self.parameters["sliding_friction"].value)


def evidence_of(
    ledger: Sequence[Move], valve: Valve, settings: IdentificationSettings | None = None
) -> Evidence:
    """Combine the moves of a ledger.

    Parameters
    ----------
    ledger : sequence of Move
        Oldest first.
    valve : Valve
        Gives the travel.
    settings : IdentificationSettings, optional
        Its timing uncertainty, calibration, and fixed spring constant are used.

    Returns
    -------
    Evidence
        Where the moves are too few, all its parameters are not identifiable, with the reason.
    """
    settings = settings or IdentificationSettings()
    every = Moves.of(ledger)
    first, changes = _since_change(ledger, every, valve.travel)
    used, moves = ledger[first:], every[first:]
    timing = settings.timing_uncertainty
    spring = settings.fixed.get("spring_constant")
    timing = TIMING_UNCERTAINTY if timing is None else timing
    balance = balance_of(moves, timing, valve.travel, spring)
    span = (used[0].begin, used[-1].end) if used else (0, 0)
    if balance is None:
        reason = _too_few(moves, bool(changes))
        parameters = {name: not_identifiable(name, reason) for name in _NAMES}
        return Evidence(len(used), *span, parameters, math.nan, changes)
    found = {
        name: calibrated(one, calibration_share(name, settings, valve.driven_by))
        for name, one in _parameters(balance, spring).items()
    }
    share = settings.position_scale_uncertainty
    found["dead_band"] = calibrated(found["dead_band"], share)
    return Evidence(len(used), *span, found, balance.speed, changes)


def _since_change(
    ledger: Sequence[Move], every: Moves, travel: float
) -> tuple[int, tuple[Change, ...]]:
    """Return the first move after the last change, and the changes that are declared."""
    series = series_of(every, travel)
    if series is None:
        return 0, ()
    splits = last_splits(series)
    changes = tuple(_change(split, ledger[0].begin) for split in splits if split.is_declared)
    return (int(series.first[splits[-1].block]) if splits else 0), changes


def _change(split: Split, origin: int) -> Change:
    earliest, latest = (origin + round(1e9 * time) for time in (split.earliest, split.latest))
    return Change(earliest, latest, split.ratio, split.low, split.high)


def _too_few(moves: Moves, has_changed: bool) -> str:
    up, down = (int(np.sum(moves.direction == way)) for way in (1, -1))
    blocks = len(set(blocks_of(moves, MOST_BLOCKS).tolist()))
    since = " since friction changed" if has_changed else ""
    return (
        f"{up} moves up and {down} down in {blocks} blocks of time{since}: {FEWEST_MOVES} of each "
        f"in {FEWEST_BLOCKS} blocks are needed; let the valve work on"
    )


def _parameters(balance: Balance, spring: float | None) -> dict[str, Parameter]:
    values = balance.values
    size = values.size

    def along(**slopes: float) -> NDArray[np.float64]:
        slope = np.zeros(size)
        for name, value in slopes.items():
            slope[_PLACES[name]] = value
        return slope

    sliding, static, k = (float(values[one]) for one in (SLIDING, STATIC, SPRING))
    numbers = {
        "sliding_friction": (sliding, along(sliding=1.0)),
        "viscous_friction": (float(values[SPEED]), along(speed=1.0)),
        "static_friction": (static, along(static=1.0)),
        "spring_constant": (k, along(spring=1.0)),
        "spring_preload": (
            float(values[PRELOAD]) - k * balance.place,
            along(preload=1.0, spring=-balance.place),
        ),
    }
    if k > 0:
        band = (sliding + static) / k
        slope = along(sliding=1 / k, static=1 / k, spring=-band / k)
        numbers["dead_band"] = (band, slope)
    found = {
        name: with_verdict(
            name, float(value), *balance.number(slope), _doubt(balance, value, slope)
        )
        for name, (value, slope) in numbers.items()
    }
    # Kept where it holds zero too: it carries the friction from one speed to another.
    slope = numbers["viscous_friction"][1]
    error, width = balance.number(slope)
    found["viscous_friction"] = Parameter(
        "viscous_friction", float(values[SPEED]), error, width, Verdict.WEAK, _MEAN_SLOPE
    )
    if spring is not None:
        found["spring_constant"] = fixed("spring_constant", spring)
    if balance.onsets < FEWEST_MOVES:
        reason = f"{balance.onsets} breakaways from a rest: {FEWEST_MOVES} are needed"
        for name in ("static_friction", "dead_band"):
            found[name] = not_identifiable(name, reason)
    spread = balance.number(along(spring=1.0))[1] / k if k > 0 else math.inf
    if spring is None and spread > _VAGUEST_SPRING:
        found["dead_band"] = not_identifiable("dead_band", _vague_spring(k, spread))
    found["coulomb_friction"] = not_identifiable("coulomb_friction", _COULOMB)
    return found


def _vague_spring(spring: float, share: float) -> str:
    if not spring > 0:
        return "the valve shows no spring"
    return (
        f"it is friction over spring, and moves that hardly leave their place know the spring to "
        f"±{percentage(share)} only: let the set point go to other places, or state "
        "fixed.spring_constant if it is known"
    )


def _doubt(balance: Balance, value: float, slope: NDArray[np.float64]) -> str:
    """Return that the lag of the signals makes most of a wide interval, or nothing."""
    _, width = balance.number(slope)
    lag = 2.0 * balance.timing * abs(float(slope @ balance.lag))
    if width <= WEAK_SHARE * abs(value) or 2.0 * lag**2 < width**2:
        return ""
    return (
        f"its interval is ±{percentage(width / abs(value))} of its value, most of it by the lag "
        f"between the signals: state a timing_uncertainty below {balance.timing:g} s if their "
        "clocks and lags are known"
    )


_PLACES = {
    "sliding": SLIDING,
    "static": STATIC,
    "spring": SPRING,
    "speed": SPEED,
    "along": ALONG,
    "preload": PRELOAD,
}
