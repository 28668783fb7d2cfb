"""What a record must hold before it is worth a regression."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.derivatives import Derivatives
from valve_friction_ros.identification.noise import position_noise
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording

__all__ = ["require_enough_samples", "require_motion", "require_two_directions"]

_MOTION_OVER_NOISE = 10.0
_LEAST_SHARE_OF_DIRECTION = 0.02


def require_enough_samples(recording: Recording, window: int) -> None:
    """Refuse a recording shorter than ten derivative windows."""
    least = 10 * window
    if len(recording) < least:
        raise RefusalError(
            f"the record is too short: {len(recording)} samples ({recording.duration:.3g} s), "
            f"at least {least} are needed"
        )


def require_motion(recording: Recording, derivatives: Derivatives) -> None:
    """Refuse a recording whose stem did not move beyond its own noise (`position_noise`)."""
    span = float(np.ptp(recording.position))
    noise = position_noise(recording.position)
    top_speed = float(np.max(np.abs(derivatives.velocity)))
    if span == 0 or top_speed == 0 or span < _MOTION_OVER_NOISE * noise:
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
    noise = position_noise(recording.position) / np.sqrt(window)
    up, down = _distances(position, _MOTION_OVER_NOISE * noise)
    if min(up, down) < _LEAST_SHARE_OF_DIRECTION * (up + down):
        way = "up" if up > down else "down"
        raise RefusalError(
            f"the stem moved {way} only ({up * 1e3:.3g} mm up, {down * 1e3:.3g} mm down): "
            "friction cannot be told from the spring; record at least one stroke each way"
        )
