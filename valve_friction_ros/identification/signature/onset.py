# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The instant at which a resting stem begins to slide under a steadily growing force."""

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

_JUMP_GAIN = 12.0
"""Decrease of the sum of squares, in variances of the residual, above which a jump is kept.

With one further parameter chance exceeds it in 5 of 10,000 records (χ² of 1 degree of freedom)."""

_FEWEST = 8
"""Samples of a fit: it has five parameters with a jump. Chosen: three samples more."""

_LAGS = (0.02, 0.1, 0.4)
_LATER = (0.0, 0.03)
"""Starts of the fit, as shares of its time span: lags, and delays of a jump after the onset of the
fit without a jump. Chosen: the best of all starts is kept."""


class Onset(NamedTuple):
    """When a stem leaves its rest, s on the axis of the samples, and the position of the rest, m.

    `jump_speed`, m/s, is the speed in the way of motion at which the stem leaves: above zero after
    a slip jump that shows.
    """

    time: float
    level: float
    jump_speed: float


def _unit_motion(since: NDArray[np.float64], lag: float, growth: float) -> NDArray[np.float64]:
    """Displacement of a first-order lag under ``t + growth·t²/2`` that begins at 0."""
    ramp = np.maximum(since, 0.0)
    linear = ramp + lag * np.expm1(-ramp / lag)
    return np.asarray(linear + growth * (0.5 * ramp**2 - lag * linear), dtype=np.float64)


def _unit_jump(since: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    """Displacement of a first-order lag that leaves 0 at speed 1."""
    return np.asarray(-lag * np.expm1(-np.maximum(since, 0.0) / lag), dtype=np.float64)


def _columns(
    time: NDArray[np.float64], onset: float, lag: float, growth: float, jumps: bool
) -> NDArray[np.float64]:
    since = time - onset
    shapes = [np.ones_like(time), _unit_motion(since, lag, growth)]
    if jumps:
        shapes.append(_unit_jump(since, lag))
    return np.column_stack(shapes)


def _fit(
    time: NDArray[np.float64],
    position: NDArray[np.float64],
    start: tuple[float, float],
    growth: float,
    jumps: bool,
) -> tuple[float, float, NDArray[np.float64], float]:
    """Least squares over onset and lag; the linear coefficients are solved within.

    Returns onset, lag, the linear coefficients and the sum of squares.
    """
    span = float(time[-1] - time[0])
    shortest = span / time.size
    scale = max(float(np.ptp(position)), np.finfo(float).tiny)

    def misfit(place: NDArray[np.float64]) -> NDArray[np.float64]:
        columns = _columns(time, place[0], float(np.exp(place[1])), growth, jumps)
        linear, *_ = np.linalg.lstsq(columns, position, rcond=None)
        return np.asarray((columns @ linear - position) / scale, dtype=np.float64)

    lowest, highest = np.log(shortest), np.log(span)
    fitted = scipy.optimize.least_squares(  # type: ignore[operator]  # the stubs take it for a module
        misfit,
        [start[0], float(np.clip(np.log(start[1]), lowest, highest))],
        bounds=([time[0], lowest], [time[-1], highest]),
        x_scale=[span / 10, 1.0],
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
    )
    onset, lag = float(fitted.x[0]), float(np.exp(fitted.x[1]))
    columns = _columns(time, onset, lag, growth, jumps)
    linear, *_ = np.linalg.lstsq(columns, position, rcond=None)
    residual = columns @ linear - position
    return onset, lag, np.asarray(linear, dtype=np.float64), float(residual @ residual)


def fit_onset(
    time: NDArray[np.float64], position: NDArray[np.float64], guess: float, growth: float = 0.0
) -> Onset:
    """Find when a stem leaves its rest, from all samples around it.

    A stem without inertia that breaks away under a force growing at a constant rate approaches a
    constant speed v as a first-order lag does, with τ = F_v/k:

        x(t) = x_r + v·(t' − τ·(1 − e^(−t'/τ))) + v_j·τ·(1 − e^(−t'/τ)),  t' = max(t − t_0, 0) .

    Where the rate itself changes, as behind a V/P converter, the ramp bends accordingly. The last
    term belongs to a slip jump, at whose onset the stem has the speed v_j. It is kept where it
    explains more than chance and v_j is above v: a stem that leaves more slowly than it slides
    later did not jump. All samples of the rest and of the motion take part, so sensor noise moves
    t_0 far less than the crossing of a level.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Time, s, evenly spaced, at least 8 samples.
    position : ndarray of float, shape (n,)
        Stem position, m: a rest, and the beginning of one motion.
    guess : float
        Approximate time of the onset, s.
    growth : float
        Relative change of the force's rate, 1/s, at the onset.

    Returns
    -------
    Onset
        Exact for the motion above without noise.

    Raises
    ------
    ValueError
        If there are too few samples.
    """
    if time.size < _FEWEST:
        raise ValueError(f"{time.size} samples are too few for an onset, at least {_FEWEST}")
    span = float(time[-1] - time[0])
    plain = min(
        (_fit(time, position, (guess, lag * span), growth, False) for lag in _LAGS),
        key=lambda one: one[-1],
    )
    jumping = min(
        (
            _fit(time, position, (plain[0] + later * span, lag * span), growth, True)
            for later in _LATER
            for lag in _LAGS
        ),
        key=lambda one: one[-1],
    )
    variance = jumping[-1] / (time.size - 5)
    sliding, leaving = jumping[2][1:] * np.sign(plain[2][1])
    is_jump = leaving > sliding and plain[-1] - jumping[-1] > _JUMP_GAIN * variance
    chosen = jumping if is_jump else plain
    return Onset(chosen[0], float(chosen[2][0]), float(leaving) if is_jump else 0.0)
