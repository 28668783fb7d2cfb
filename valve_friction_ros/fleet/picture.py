"""The small picture of a recording: its valve signature, as points of a line."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model import Recording

__all__ = ["HEIGHT", "WIDTH", "signature_points"]

WIDTH, HEIGHT = 120, 64
"""Size of the picture, in its own units."""

_STEP = 1.0
"""Distance between two points. Chosen: as fine as a screen shows at this size."""
_MOST = 500
"""Points of a picture. Chosen: some strokes, in 5 kB."""


def _scaled(values: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    span = float(np.ptp(values)) or 1.0
    return np.asarray(1.0 + (values - values.min()) / span * (length - 2), dtype=np.float64)


def signature_points(recording: Recording) -> str:
    """Return stem position over drive as the points of an SVG polyline, rounded.

    A long recording shows its first strokes.
    """
    across, up = _scaled(recording.drive, WIDTH), HEIGHT - _scaled(recording.position, HEIGHT)
    points = [(float(across[0]), float(up[0]))]
    for x, y in zip(across.tolist(), up.tolist(), strict=True):
        if abs(x - points[-1][0]) + abs(y - points[-1][1]) >= _STEP:
            points.append((x, y))
            if len(points) == _MOST:
                break
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
