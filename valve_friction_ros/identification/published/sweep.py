# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Regression of the force balance, (3) to (7), sweep of δv, (6) to (8), (17), (18), and result."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.drawing import Curve, Drawing, Panel
from valve_friction_ros.identification.settings import REGRESSED, UNITS, IdentificationSettings
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.compiled import compiled_reductions
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.signals import Derivatives


@dataclass(frozen=True, eq=False)
class ForceBalanceRegression:
    """Regressors φ(t) of (5), (n, p), the force that they explain, N, and the speed, m/s.

    The force is that of the actuator minus the contribution of the parameters that are `fixed`.
    Where the `position_bias` x̄ of (10) is known, the preload follows from it.
    """

    names: tuple[str, ...]
    columns: NDArray[np.float64]
    force: NDArray[np.float64]
    speed: NDArray[np.float64]
    fixed: Mapping[str, float]
    position_bias: float | None

    def complete(self, estimates: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Name the free `estimates`, shape (..., p), and add the fixed values."""
        shape = estimates.shape[:-1]
        named = {name: estimates[..., index] for index, name in enumerate(self.names)}
        for name in REGRESSED:
            if name not in named and name in self.fixed:
                named[name] = np.full(shape, self.fixed[name])
        if self.position_bias is not None:
            named["spring_preload"] = named["spring_constant"] * self.position_bias
        return {name: named[name] for name in REGRESSED}

    def fixing(self, name: str, value: float) -> "ForceBalanceRegression":
        """Fix a free parameter: its contribution to the force leaves the regression."""
        index = self.names.index(name)
        return replace(
            self,
            names=tuple(each for each in self.names if each != name),
            columns=np.delete(self.columns, index, axis=1),
            force=self.force - value * self.columns[:, index],
            fixed={**self.fixed, name: value},
        )


def force_balance_regression(
    force: NDArray[np.float64],
    position: NDArray[np.float64],
    derivatives: Derivatives,
    settings: IdentificationSettings,
) -> ForceBalanceRegression:
    """Set up the regression (4) for the m = n − d + 1 samples that have derivatives.

    Force (N) and position (m) have the shape (n,). The settings name the fixed parameters, and the
    position bias if it is known.
    """
    bias = settings.position_bias
    velocity = derivatives.velocity
    place = derivatives.inner(position)
    regressors = {
        "mass": derivatives.acceleration,
        "coulomb_friction": np.sign(velocity),
        "viscous_friction": velocity,
        "spring_constant": place if bias is None else place + bias,
        "spring_preload": np.ones_like(velocity),
    }
    if bias is not None:
        del regressors["spring_preload"]
    target = derivatives.inner(force).copy()
    for name in settings.fixed:
        if name in regressors:
            target -= settings.fixed[name] * regressors.pop(name)
    fixed = {name: value for name, value in settings.fixed.items() if name in REGRESSED}
    return ForceBalanceRegression(
        tuple(regressors),
        np.column_stack([*regressors.values()]) if regressors else np.empty((target.size, 0)),
        target,
        np.abs(velocity),
        fixed,
        bias,
    )


_ROWS_AT_ONCE = 256
"""Rows reflected into the factor at once; with six columns they take 12 kB of a 32 kB cache."""


@compiled_reductions
def factors_above(
    regressors: NDArray[np.float64],
    force: NDArray[np.float64],
    speed: NDArray[np.float64],
    thresholds: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Factorise ``[Φ_s F_s]``, the samples faster than each of the increasing thresholds.

    From the highest threshold down each step only adds the rows between two thresholds, which
    Householder reflections merge into the current triangular factor: ``[R; rows] = Q R'``.
    Every row is visited once, and, unlike in sums of products, the condition of the columns is
    not squared. Columns may be of any size, since reflections do not mix them.

    Returns the upper triangular R with RᵀR = ΦᵀΦ of the selected rows, (S, p, p), the signs of its
    rows free; the sums of these rows, (S, p); and their number, (S,).
    """
    free, steps = regressors.shape[1], thresholds.size
    columns = free + 1
    bins, ends = _sorted_places(speed, thresholds)
    rows = np.empty((speed.size, columns))
    sums = np.zeros((steps, columns))
    for sample in range(speed.size):
        step = bins[sample]
        if step >= 0:
            place = ends[step]
            ends[step] += 1
            for column in range(free):
                rows[place, column] = regressors[sample, column]
                sums[step, column] += regressors[sample, column]
            rows[place, free] = force[sample]
            sums[step, free] += force[sample]
    factors = np.empty((steps, columns, columns))
    counts = np.empty(steps, dtype=np.int64)
    work = np.zeros((columns, columns + _ROWS_AT_ONCE))
    taken = 0
    for step in range(steps - 1, -1, -1):
        while taken < ends[step]:
            last = min(taken + _ROWS_AT_ONCE, ends[step])
            _take_in(work, rows, taken, last)
            taken = last
        counts[step] = taken
        for row in range(columns):
            if step < steps - 1:
                sums[step, row] += sums[step + 1, row]
            for column in range(columns):
                factors[step, row, column] = work[column, row]
    return factors, sums, counts


@compiled_reductions
def _sorted_places(
    speed: NDArray[np.float64], thresholds: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find the last threshold below each speed, and where the rows of each threshold begin.

    Rows of the highest threshold come first. A threshold is guessed as if all were evenly spaced,
    as those of (8) are, and the guess is moved to where it is true.
    """
    steps = thresholds.size
    spacing = (thresholds[-1] - thresholds[0]) / max(steps - 1, 1)
    bins = np.empty(speed.size, dtype=np.int64)
    sizes = np.zeros(steps, dtype=np.int64)
    for sample in range(speed.size):
        step = 0
        if spacing > 0:
            guess = (speed[sample] - thresholds[0]) / spacing
            step = int(min(max(guess, 0.0), steps - 1.0))
        while step >= 0 and speed[sample] <= thresholds[step]:
            step -= 1
        while step < steps - 1 and speed[sample] > thresholds[step + 1]:
            step += 1
        bins[sample] = step
        if step >= 0:
            sizes[step] += 1
    places = np.empty(steps, dtype=np.int64)
    place = 0
    for step in range(steps - 1, -1, -1):
        places[step] = place
        place += sizes[step]
    return bins, places


@compiled_reductions
def _take_in(work: NDArray[np.float64], rows: NDArray[np.float64], first: int, end: int) -> None:
    """Reflect the rows from `first` to `end` into the triangular factor.

    Column by column: `work` holds in row j the j-th column of the factor, upper triangular, and
    behind it room for the column of the new rows.
    """
    columns = rows.shape[1]
    last = columns + end - first
    for row in range(end - first):
        for column in range(columns):
            work[column, columns + row] = rows[first + row, column]
    for column in range(columns):
        x = work[column]
        squares = 0.0
        for place in range(columns, last):
            squares += x[place] * x[place]
        if squares == 0.0:
            continue
        norm = math.copysign(math.sqrt(x[column] * x[column] + squares), x[column])
        head = x[column] + norm
        for other in range(column + 1, columns):
            y = work[other]
            product = head * y[column]
            for place in range(columns, last):
                product += x[place] * y[place]
            share = product / (norm * head)
            y[column] -= share * head
            for place in range(columns, last):
                y[place] -= share * x[place]
        x[column] = -norm


_DEPENDENT = 1e-10
"""Share of a column's length below which its independent part counts as zero.

Chosen between rounding (1e-15) and the smallest share in 54 simulated records (6e-7, F_0 on a
square wave without noise)."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Estimates for each threshold δv(s), s = 1 … S, in increasing order.

    Where a threshold leaves too few samples, or samples that do not determine the free
    parameters, its estimates, `sigma`, `r_squared` and `log_information` are nan.

    Attributes
    ----------
    thresholds : ndarray of float, shape (S,)
        δv(s), m/s.
    estimates : mapping of str to ndarray of float, shape (S,) each
        Parameters by name, in SI units.
    sigma : ndarray of float, shape (S,)
        Standard deviation σ_s of the force residual (17), N.
    r_squared : ndarray of float, shape (S,)
        R²_s of (18).
    samples : ndarray of int, shape (S,)
        Number n_s of samples faster than the threshold.
    log_information : ndarray of float, shape (S,)
        ln det ΦᵀΦ of the selected regressors, for the choice of the threshold.
    free : int
        Number n_P of free parameters.
    """

    thresholds: NDArray[np.float64]
    estimates: Mapping[str, NDArray[np.float64]]
    sigma: NDArray[np.float64]
    r_squared: NDArray[np.float64]
    samples: NDArray[np.int64]
    log_information: NDArray[np.float64]
    free: int


def sweep_thresholds(regression: ForceBalanceRegression, thresholds: NDArray[np.float64]) -> Sweep:
    """Solve (7) on the samples above each of the increasing thresholds, m/s, in one pass over them.

    The triangular factor of the regressors with the force beside them, ``[Φ_s F_s] = Q R``, is
    carried from the highest threshold down (`factors_above`). Its leading block gives the
    estimates, its last diagonal entry the residual norm.
    """
    free = len(regression.names)
    factors, sums, samples = factors_above(
        regression.columns, regression.force, regression.speed, thresholds
    )
    regressors, force = factors[:, :free, :free], factors[:, :free, free]
    own = np.abs(np.diagonal(regressors, axis1=1, axis2=2))
    lengths = np.linalg.norm(regressors, axis=1)
    determined = (samples > free + 1) & np.all(own > _DEPENDENT * lengths, axis=1)

    estimates = np.full((thresholds.size, free), np.nan)
    sigma, r_squared, log_information = (np.full(thresholds.size, np.nan) for _ in range(3))
    solved = np.linalg.solve(regressors[determined], force[determined][..., None])[..., 0]
    count, residual = samples[determined], factors[determined, free, free]
    mean = sums[determined, free] / count
    explained = np.sum(force[determined] ** 2, axis=1)
    modelled = np.sum(sums[determined, :free] * solved, axis=1)
    spread = explained - 2 * mean * modelled + count * mean**2
    total = explained + residual**2 - count * mean**2
    estimates[determined] = solved
    sigma[determined] = np.abs(residual) / np.sqrt(count - free)
    r_squared[determined] = np.divide(
        spread, total, out=np.full(total.size, np.nan), where=total > 0
    )
    log_information[determined] = 2 * np.sum(np.log(own[determined]), axis=1)
    return Sweep(
        thresholds,
        regression.complete(estimates),
        sigma,
        r_squared,
        samples,
        log_information,
        free,
    )


SETTLED_SHARE = 0.1
"""Largest difference of σ_s in the chosen region, as a share of σ_s at the threshold. Chosen."""

_THRESHOLD = "threshold δv [m/s]"


def _panels(sweep: Sweep, threshold: float, friction: Parameter) -> tuple[Panel, ...]:
    """Return F_c, σ_s and, for reports, R²_s over the threshold δv, and F_c of the result."""
    thresholds, coulomb_friction = sweep.thresholds, sweep.estimates["coulomb_friction"]
    chosen = int(np.argmin(np.abs(thresholds - threshold)))
    sigma = np.maximum(sweep.sigma, 1e-9 * np.nanmax(sweep.sigma))
    return (
        Panel(
            "coulomb",
            _THRESHOLD,
            "Coulomb friction $F_c$ [N]",
            (
                Curve(thresholds, coulomb_friction),
                Curve([threshold], [coulomb_friction[chosen]], "o"),
            ),
            "δv sweep (● published choice, dashed: result, with 95 % band)",
            level=friction,
        ),
        Panel(
            "sigma",
            _THRESHOLD,
            "$\\sigma_s$ [N]",
            (Curve(thresholds, sigma),),
            chosen=threshold,
            is_logarithmic=True,
        ),
        Panel(
            "r_squared",
            _THRESHOLD,
            "$R^2_s$ [-]",
            (Curve(thresholds, sweep.r_squared),),
            chosen=threshold,
            is_detail=True,
        ),
    )


def chosen_region(sweep: Sweep, threshold: float) -> tuple[float, float]:
    """Return the lowest and highest threshold, m/s, of the region around the chosen threshold."""
    choice = int(np.argmin(np.abs(sweep.thresholds - threshold)))
    level = sweep.sigma[choice]
    settled = np.abs(sweep.sigma - level) <= SETTLED_SHARE * level
    others = np.flatnonzero(~settled)
    below, above = others[others < choice], others[others > choice]
    first = int(below[-1]) + 1 if below.size else 0
    last = int(above[0]) - 1 if above.size else sweep.thresholds.size - 1
    return float(sweep.thresholds[min(first, choice)]), float(sweep.thresholds[max(last, choice)])


@dataclass(frozen=True, eq=False)
class Estimate:
    """The parameters that the published method finds, with the figures of their sweep.

    Attributes
    ----------
    mass, viscous_friction, coulomb_friction : float
        See `static_friction`.
    static_friction, spring_constant, spring_preload : float
        Parameters in SI units, as regressed: an impossible value (a negative mass, say) is shown
        as it is, with a warning.
    threshold : float
        Chosen threshold δv, m/s.
    samples : int
        Samples faster than the threshold.
    sigma : float
        Standard deviation σ_s of the force residual (17), N.
    r_squared : float
        R²_s of (18).
    fixed : tuple of str
        Parameters that were given or assumed, not identified.
    warnings : tuple of str
        Limitations of the numbers, one sentence each.
    settings : IdentificationSettings
        Settings in force; an assumed mass is among the fixed parameters.
    sweep : Sweep
        The whole sweep.
    """

    mass: float
    viscous_friction: float
    coulomb_friction: float
    static_friction: float
    spring_constant: float
    spring_preload: float
    threshold: float
    samples: int
    sigma: float
    r_squared: float
    fixed: tuple[str, ...]
    warnings: tuple[str, ...]
    settings: IdentificationSettings = field(repr=False)
    sweep: Sweep = field(repr=False)

    @property
    def values(self) -> dict[str, float]:
        """The parameters by name, in the order of `UNITS`."""
        return {name: getattr(self, name) for name in UNITS}

    def drawing(self, parameters: Mapping[str, Parameter], valve: Valve) -> Drawing:  # noqa: ARG002
        """Return the sweep as figures and reports show it."""
        sweep, settings = self.sweep, self.settings
        low, high = chosen_region(sweep, self.threshold)
        return Drawing(
            _panels(sweep, self.threshold, parameters["coulomb_friction"]),
            "Sweep of the velocity threshold δv",
            f"The friction force balance, fitted to the samples faster than each threshold δv. "
            f"Chosen: {self.threshold * 1e3:.3g} mm/s, with {self.samples} samples above it, σ_s "
            f"{self.sigma:.4g} N and R² {self.r_squared:.5f}. Shaded: the region around it, "
            f"{low * 1e3:.3g} to {high * 1e3:.3g} mm/s, where σ_s stays within "
            f"{100 * SETTLED_SHARE:.0f} % of that.",
            "Coulomb friction, standard deviation and correlation over the velocity threshold, "
            "with the chosen threshold and the region around it marked.",
            (low, high),
            settings={
                "of the published method": f"window {settings.published_window} samples, "
                f"polynomial order {settings.order}, {settings.steps} thresholds"
            },
        )

    def parameters(self) -> KarnoppParameters:
        """Return the parameters as a model to simulate.

        Raises ValueError if an identified value is impossible; the message names it.
        """
        return KarnoppParameters(**self.values)


def possible_model(estimate: Estimate) -> KarnoppParameters | None:
    """Return the regressed values as a model, None where one of them is impossible."""
    try:
        return estimate.parameters()
    except ValueError:
        return None
