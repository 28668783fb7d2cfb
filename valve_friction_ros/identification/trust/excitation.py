"""What a record must hold before it is worth a regression."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.measured_record import measured

__all__ = [
    "require_enough_samples",
    "require_motion",
    "require_related_signals",
    "require_stem_between_stops",
    "require_travel",
    "require_two_directions",
]

_MOTION_OVER_NOISE = 10.0
_LEAST_SHARE_OF_DIRECTION = 0.02
_LEAST_TRAVEL = 0.01
_MOST_AT_A_STOP = 0.5
_OUTSIDE = 0.05
_LEAST_FOLLOWED = 0.1
_SURELY_FOLLOWED = 0.5
_FOLLOWED_BLOCK = 0.1
_MOVING_SHARE = 0.05
_LEAST_SAMPLES_A_STROKE = 10


def require_enough_samples(recording: Recording, window: int) -> None:
    """Refuse a recording shorter than ten derivative windows."""
    least = 10 * window
    if len(recording) < least:
        raise RefusalError(
            f"the record is too short: {len(recording)} samples ({recording.duration:.3g} s), "
            f"at least {least} are needed"
        )


def require_motion(recording: Recording) -> None:
    """Refuse a recording whose stem did not move beyond its own noise."""
    span = float(np.ptp(recording.position))
    noise = measured(recording).white_noise
    if span == 0 or span < _MOTION_OVER_NOISE * noise:
        raise RefusalError(
            f"the stem did not move: its position spans {span * 1e6:.3g} µm with "
            f"{noise * 1e6:.3g} µm of noise; excite the valve over several percent of its travel"
        )


def _distances(position: NDArray[np.float64], deadband: float) -> tuple[float, float]:
    """Distances moved up and down, turns smaller than `deadband` left out."""
    up = down = 0.0
    highest = lowest = turn = float(position[0])
    direction = 0
    for place in position.tolist():
        highest, lowest = max(highest, place), min(lowest, place)
        if direction >= 0 and place < highest - deadband:
            up += highest - turn
            turn, lowest, direction = highest, place, -1
        elif direction <= 0 and place > lowest + deadband:
            down += turn - lowest
            turn, highest, direction = lowest, place, 1
    if direction >= 0:
        up += highest - turn
    if direction <= 0:
        down += turn - lowest
    return up, down


def require_two_directions(recording: Recording, window: int) -> None:
    """Refuse a stem that moves one way only, or hardly ever the other.

    The position is averaged over `window` samples first, and turns within its noise are ignored.
    """
    means = len(recording) // window
    position = recording.position[: means * window].reshape(means, window).mean(axis=1)
    noise = measured(recording).white_noise / np.sqrt(window)
    up, down = _distances(position, _MOTION_OVER_NOISE * noise)
    if min(up, down) < _LEAST_SHARE_OF_DIRECTION * (up + down):
        way = "up" if up > down else "down"
        raise RefusalError(
            f"the stem moved {way} only ({up * 1e3:.3g} mm up, {down * 1e3:.3g} mm down): "
            "friction cannot be told from the spring; record at least one stroke each way"
        )


def require_travel(recording: Recording, valve: Valve) -> None:
    """Refuse a stem that leaves the travel, or moves over hardly any of it."""
    travel = valve.travel
    lowest, highest = float(recording.position.min()), float(recording.position.max())
    if not np.isfinite(travel):
        return
    if lowest < -_OUTSIDE * travel or highest > (1 + _OUTSIDE) * travel:
        raise RefusalError(
            f"the stem position runs from {lowest:.4g} to {highest:.4g} m, the travel from 0 to "
            f"{travel:.4g} m: check for swapped signals, the unit (m), the zero and the travel"
        )
    if highest - lowest < _LEAST_TRAVEL * travel:
        raise RefusalError(
            f"too little travel: the stem moved {(highest - lowest) * 1e3:.3g} mm, "
            f"{100 * (highest - lowest) / travel:.2g} % of its travel; "
            "excite the valve over several percent of it"
        )


def require_stem_between_stops(recording: Recording, valve: Valve) -> None:
    """Refuse a stem that lies at a travel stop for most of the record."""
    travel = valve.travel
    if not np.isfinite(travel):
        return
    reach = max(5 * measured(recording).white_noise, 1e-3 * travel)
    for name, distance in (
        ("lower", np.abs(recording.position)),
        ("upper", np.abs(recording.position - travel)),
    ):
        share = float(np.mean(distance < reach))
        if share > _MOST_AT_A_STOP:
            raise RefusalError(
                f"the stem lies at its {name} stop for {100 * share:.0f} % of the record, where "
                "pressure says nothing about friction: excite the valve around mid-travel"
            )


def _followed(recording: Recording) -> tuple[float, float]:
    """Fit the pressure of the moving stem by its position and the way it moves.

    While the stem moves, pressure follows position, shifted up or down by the friction; while it
    rests, pressure may do anything within the dead band, so rests are left out.

    Returns
    -------
    slope, share : float
        Pressure over position, Pa/m, and the share of the variance that is explained.
    """
    length = max(round(_FOLLOWED_BLOCK / recording.sample_period), 1)
    blocks = len(recording) // length
    position, pressure = (
        signal[: blocks * length].reshape(blocks, length).mean(axis=1)
        for signal in (recording.position, recording.pressure)
    )
    moves = np.diff(position)
    moving = np.abs(moves) > _MOVING_SHARE * np.abs(moves).max()
    place, target = (0.5 * (one[1:] + one[:-1])[moving] for one in (position, pressure))
    columns = np.column_stack([place - place.mean(), np.sign(moves[moving]), np.ones(place.size)])
    fitted, *_ = np.linalg.lstsq(columns, target, rcond=None)
    left = target - columns @ fitted
    total = float(np.sum((target - target.mean()) ** 2))
    share = 1 - float(left @ left) / total if total > 0 else 0.0
    return float(fitted[0]), share


def require_related_signals(recording: Recording) -> None:
    """Refuse pressure and stem that do not move together, or move too fast for the sampling."""
    pressure, position = recording.pressure, recording.position
    if np.ptp(pressure) == 0:
        raise RefusalError("the pressure did not change: excite the valve, or check its sensor")
    slope, share = _followed(recording)
    if share < _LEAST_FOLLOWED:
        raise RefusalError(
            "pressure and stem do not move together (place and way of the moving stem explain "
            f"{100 * share:.0f} % of the pressure): check for the wrong valve, a dead sensor, "
            "swapped signals or clocks far apart"
        )
    if slope < 0 and share > _SURELY_FOLLOWED:
        raise RefusalError(
            "the stem moves against the pressure: count the position in the direction in which "
            "pressure pushes the stem"
        )
    step = float(np.max(np.abs(np.diff(position))))
    span = float(np.ptp(position))
    if step * _LEAST_SAMPLES_A_STROKE > span:
        raise RefusalError(
            f"sampling is too slow for the motion: the stem moves {100 * step / span:.0f} % of "
            f"its range between two samples, {recording.sample_period:.3g} s apart; sample faster, "
            "or look for a glitch of the stem sensor"
        )
