# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The result: what every method of identification returns."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from sys import float_info
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification import rendering
from valve_friction_ros.identification.drawing import (
    FRICTION_CURVE,
    IMPERFECTIONS_FOUND,
    Drawing,
    friction_drawing,
)
from valve_friction_ros.identification.published.sweep import Estimate
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import SLIDING, IdentificationSettings
from valve_friction_ros.identification.signature.valve_signature import ValveSignature
from valve_friction_ros.identification.trust.stated import CONTRADICTED, with_stated
from valve_friction_ros.identification.trust.uncertainty import CORRELATION
from valve_friction_ros.identification.trust.verdict import Misfit, Parameter, with_calibration
from valve_friction_ros.model.checks import equal_by_fields, frozen, require_type, require_whole
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.simulation import simulate
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.wording import evidence_ratio_words, with_width


class Support(Enum):
    """How strongly a record favours one of two models, after Kass and Raftery (1995)."""

    HARDLY = 1.0
    POSITIVE = 3.0
    STRONG = 20.0
    VERY_STRONG = 150.0

    @classmethod
    def of(cls, log_ratio: float) -> "Support":
        """Return the strongest support whose ratio, its value, is reached in either direction."""
        return max(
            (one for one in cls if abs(log_ratio) >= math.log(one.value)), key=lambda one: one.value
        )


@equal_by_fields
@dataclass(frozen=True)
class ModelComparison:
    """Two models of one record.

    `log_ratio` is the natural logarithm of the evidence for the first over that for the second.
    Each has an `rms` residual of the stem, m, a number of `free` parameters, and `describes` the
    valve if its residual is no more than noise. The samples of the stem are worth `independent`
    ones.
    """

    log_ratio: float
    rms: tuple[float, float]
    free: tuple[int, int]
    samples: float
    independent: float
    describes: tuple[bool, bool] = (True, True)

    @property
    def support(self) -> Support:
        """How strongly the record favours one of the models."""
        return Support.of(self.log_ratio)

    def __str__(self) -> str:
        """Return the comparison in words."""
        return evidence_ratio_words(
            self.support.name, self.log_ratio, self.samples, self.independent, self.describes
        )


def independent_samples(residual: NDArray[np.float64]) -> float:
    """Return the number of independent samples that an autocorrelated residual is worth.

    The autocorrelation is summed up to the lag at which a pair of neighbours is negative (Geyer's
    initial positive sequence).
    """
    size, shares = residual.size, _autocorrelation(residual)
    if not shares[0] > 0:
        return float(size)
    pairs = shares[: size // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs < 0)
    pairs = pairs[: negative[0]] if negative.size else pairs
    return float(np.clip(size / max(2.0 * float(np.sum(pairs)) - 1.0, 1.0), 1.0, size))


def models_compared(
    residuals: tuple[NDArray[np.float64], NDArray[np.float64]],
    free: tuple[int, int],
    describes: tuple[bool, bool] = (True, True),
) -> ModelComparison:
    """Compare two models by their residuals, m, on the same samples of the stem.

    The evidence is Schwarz's: −n/2·ln(mean square) − p/2·ln n, with n independent samples and p
    free parameters. The residual of a model is autocorrelated, so n is the number of samples over
    the sum of its autocorrelation at all lags, for the model with the smaller n. That is rough: the
    two stems differ in few places, and the ratio of two wrong models says which is nearer, not
    which is true.
    """
    samples = float(residuals[0].size)
    independent = min(map(independent_samples, residuals))
    squares = [float(np.mean(one**2)) for one in residuals]
    least = float_info.min
    fits = [-0.5 * independent * math.log(max(one, least)) for one in squares]
    costs = [0.5 * count * math.log(independent) for count in free]
    log_ratio = (fits[0] - costs[0]) - (fits[1] - costs[1])
    rms = math.sqrt(squares[0]), math.sqrt(squares[1])
    return ModelComparison(log_ratio, rms, free, samples, independent, describes)


if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class Pause(NamedTuple):
    """A rest that was left out of a record: its beginning, s, and its length, s."""

    time: float
    length: float


class StemComparison(NamedTuple):
    """Measured position, as used in the identification, and simulated position.

    Attributes
    ----------
    sample_period : float
        Time between two samples, s.
    measured, simulated : ndarray of float, shape (m,)
        Positions, m.
    start : float
        Time of the first sample since the record began, s.
    pauses : tuple of Pause
        Rests that were left out; the time of each excludes the earlier rests.
    """

    sample_period: float
    measured: NDArray[np.float64]
    simulated: NDArray[np.float64]
    start: float = 0.0
    pauses: tuple[Pause, ...] = ()

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample since the record began, s, shape (m,)."""
        time = self.start + np.arange(self.measured.size, dtype=np.float64) * self.sample_period
        before = np.searchsorted([one.time for one in self.pauses], time)
        return np.asarray(time + np.cumsum([0.0, *(one.length for one in self.pauses)])[before])

    @property
    def residual(self) -> NDArray[np.float64]:
        """Simulated minus measured position, m, shape (m,)."""
        return self.simulated - self.measured

    def autocorrelation(self, lags: int) -> NDArray[np.float64]:
        """Return the autocorrelation of the residual at lags of 0 … `lags` − 1 samples."""
        return _autocorrelation(self.residual)[:lags]


def _autocorrelation(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the autocorrelation at each lag: 1 at lag 0; a residual of zeros has 0 everywhere."""
    centred = residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * centred.size)) ** 2
    products = np.fft.irfft(spectrum, 2 * centred.size)[: centred.size]
    return np.asarray(products / (float(products[0]) or 1.0), dtype=np.float64)


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """Identified parameters with their verdicts, and the evidence behind them.

    Attributes
    ----------
    method : str
        Name of the method, as in `METHODS`.
    recording : Recording
        The record that was identified.
    valve : Valve
        Geometry of the valve.
    settings : IdentificationSettings
        Settings of the identification.
    parameters : mapping of str to Parameter
        By name: those of `UNITS`, the extensions that the record demanded, `sliding_friction`.
        Their intervals include the uncertainties of area and sensor scales in `settings`. A
        parameter that contradicts a stated value or depends on an assumed area is weak at most.
    fit : float
        Share of the stem's movement that the model reproduces, at most 1; of the force where no
        stem is simulated.
    rms : float
        Root mean square of simulated minus measured position, m; nan where no stem is simulated.
    misfit : Misfit or None
        Test of the model against the stem or, without a spring, against the force; None in a
        method without this test.
    derivative_window : int
        Derivative window in use, samples; 0 in a method without derivatives.
    warnings : tuple of str
        Limitations of the numbers, one sentence each.
    evidence : mapping of str to object
        Further values of the method, by name, SI units.
    findings : tuple of str
        The evidence in words, one sentence each.
    model : KarnoppParameters or None
        The identified model, to simulate; None where a value is impossible.
    exhibit : Estimate, ValveSignature or None
        Evidence drawn beside record and stem, such as a sweep or a valve signature.
    stem : StemComparison or None
        Measured and simulated stem; None where no stem is simulated.
    sliding_speed : float
        Mean speed of the stem over the distance, ∫|v|·|dx| / ∫|dx|, m/s: the speed at which
        `sliding_friction` holds; nan where it is unknown.
    stated_by : IdentificationSettings or None
        Settings whose stated values have been applied, so that a changed copy applies them once.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> packing = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
    >>> time = np.arange(4000) / 100
    >>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
    >>> stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
    >>> result = vf.identify(vf.Recording(0.01, pressure, stem.position), valve)
    >>> str(result).splitlines()[0].split()
    ['parameter', 'value', '±', '95', '%', 'unit', 'verdict', 'published']
    >>> result.to_dict()["parameters"]["spring_constant"]["unit"]
    'N/m'
    """

    method: str
    recording: Recording = field(repr=False)
    valve: Valve
    settings: IdentificationSettings
    parameters: Mapping[str, Parameter]
    fit: float
    rms: float
    misfit: Misfit | None
    derivative_window: int
    warnings: tuple[str, ...] = ()
    evidence: Mapping[str, object] = field(default_factory=dict, repr=False)
    findings: tuple[str, ...] = field(default=(), repr=False)
    model: KarnoppParameters | None = field(default=None, repr=False)
    exhibit: Estimate | ValveSignature | None = field(default=None, repr=False)
    stem: StemComparison | None = field(default=None, repr=False)
    sliding_speed: float = math.nan
    stated_by: IdentificationSettings | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Apply calibration and stated values, for every method; freeze the mappings."""
        parameters, evidence = with_calibration(
            self.parameters, self.evidence, self.settings, self.recording.driven_by
        )
        if self.stated_by != self.settings:  # else a copy of a result that has them applied
            parameters, told, sentences = with_stated(
                parameters, self.settings.stated, self.settings.assumed, self.valve, self.recording
            )
            if told:
                evidence[CONTRADICTED] = told
            object.__setattr__(self, "warnings", (*sentences, *self.warnings))
            object.__setattr__(self, "stated_by", self.settings)
        object.__setattr__(self, "parameters", frozen(parameters))
        object.__setattr__(self, "evidence", frozen(evidence))

    @property
    def values(self) -> dict[str, float]:
        """The identified values by name; nan where a parameter is not identifiable."""
        return {name: parameter.value for name, parameter in self.parameters.items()}

    def difference(self, other: "Result") -> dict[str, tuple[float, float]]:
        """Return this result minus another of the same sensors, by parameter.

        Each entry is the difference and half the width of its 95 % interval, SI units. Errors of
        area and sensor scales are common to both and left out; other errors are taken as
        independent. Parameters that either result does not know are omitted.
        """
        found = {}
        for name, one in self.parameters.items():
            if name not in other.parameters:
                continue
            now, before = one.without_calibration, other.parameters[name].without_calibration
            difference = now.value - before.value
            width = math.hypot(now.half_width, before.half_width)
            if math.isfinite(difference) and math.isfinite(width):
                found[name] = (difference, width)
        return found

    def correlation(self) -> "pd.DataFrame":
        """Return the correlation of the errors of the parameters, −1 to 1.

        It is evaluated at the most probable estimate, where the model is linearised.

        Raises
        ------
        RefusalError
            If the method gives none: ``published`` and ``signature`` judge each number alone.
        """
        import pandas as pd  # noqa: PLC0415 - slow to import

        found: Any = self.evidence.get(CORRELATION)
        if found is None:
            raise RefusalError(
                f"the method {self.method} does not give a correlation: use the method plant or "
                "bench"
            )
        return pd.DataFrame(found["matrix"], found["names"], found["names"])

    def covariance(self) -> "pd.DataFrame":
        """Return the covariance of the identified parameters, SI units.

        The standard deviations are the standard errors of the parameters, which include everything
        that widens their intervals; the correlation is that of `correlation`. A parameter that is
        fixed or not identifiable is omitted.

        Raises
        ------
        RefusalError
            If the method gives no correlation.
        """
        whole = self.correlation()
        errors = {
            name: one.standard_error
            for name, one in self.parameters.items()
            if name in whole.index and one.standard_error > 0
        }
        whole = whole.loc[list(errors), list(errors)]
        deviation = np.array(list(errors.values()))
        return whole * np.outer(deviation, deviation)

    def against(self, other: "Result") -> ModelComparison:
        """Return how much more probable this model is than another model of the same record.

        Parameters
        ----------
        other : Result
            Another method, or other settings, with the same record.

        Returns
        -------
        ModelComparison
            The evidence ratio; ``str`` gives it in words.

        Raises
        ------
        RefusalError
            If one of the two simulated no stem.
        ValueError
            If they are of different records.
        """
        require_type("other", other, "what vf.identify returns", Result)
        mine, others = self.stem, other.stem
        if mine is None or others is None:
            raise RefusalError(
                "a model without a simulated stem cannot be compared: use the method bench"
            )
        if self.recording is not other.recording and not (
            np.array_equal(self.recording.position, other.recording.position)
            and np.array_equal(self.recording.drive, other.recording.drive)
        ):
            raise ValueError(
                "the two results come from different records: compare models of the same record"
            )
        begin = max(mine.start, others.start)
        end = min(float(mine.time[-1]), float(others.time[-1]))
        grid = np.arange(begin, end, self.recording.sample_period)
        residuals = tuple(np.interp(grid, one.time, one.residual) for one in (mine, others))
        return models_compared(
            (residuals[0], residuals[1]),
            (_free_parameters(self), _free_parameters(other)),
            (_describes(self), _describes(other)),
        )

    def stem_band(
        self, drive: NDArray[np.float64], sample_period: float, draws: int = 40
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the 95 % band of the simulated stem due to the uncertainty of its model.

        Parameters
        ----------
        drive : ndarray of float, shape (n,)
            Actuator pressure, Pa, or force, N, as in the record.
        sample_period : float
            Time between two samples, s.
        draws : int
            Number of models drawn from the covariance of the parameters, at least two.

        Returns
        -------
        tuple of ndarray of float, shape (n,)
            Limits of the 95 % interval at each sample, m. Model error and sensor noise come on
            top.

        Raises
        ------
        RefusalError
            If there is no model, or the method gives no correlation.
        ValueError
            If fewer than two models are to be drawn.
        """
        require_whole("draws", draws, 2)
        model, spread = self.simulated_model(), self.covariance()
        names = [one.name for one in fields(model) if one.name in spread.index]
        errors = spread.loc[names, names].to_numpy()
        centre = np.array([getattr(model, name) for name in names])
        random = np.random.default_rng(0)
        stems = []
        for values in random.multivariate_normal(centre, errors, draws, check_valid="ignore"):
            drawn = dict(zip(names, values.tolist(), strict=True))
            drawn |= {name: max(drawn[name], 0.0) for name in names if name != "spring_preload"}
            coulomb = drawn.get("coulomb_friction", model.coulomb_friction)
            slip = model.static_friction - model.coulomb_friction
            static = drawn.get("static_friction", coulomb + slip)
            drawn["static_friction"] = max(static, coulomb)
            one = replace(model, **drawn)
            stems.append(simulate(self.valve, one, np.asarray(drive), sample_period).position)
        low, high = np.quantile(stems, [0.025, 0.975], axis=0)
        return low, high

    def simulate(self, drive: NDArray[np.float64], sample_period: float) -> NDArray[np.float64]:
        """Simulate the identified model under a drive, from rest.

        Parameters
        ----------
        drive : ndarray of float, shape (n,)
            Actuator pressure, Pa, or force, N, as in the record.
        sample_period : float
            Time between two samples, s.

        Returns
        -------
        ndarray of float, shape (n,)
            Stem position, m.

        Raises
        ------
        RefusalError
            If the record did not determine a model.
        """
        return simulate(
            self.valve, self.simulated_model(), np.asarray(drive, np.float64), sample_period
        ).position

    def simulated_model(self) -> KarnoppParameters:
        """Return the model to simulate; raises RefusalError if the record determined none."""
        if self.model is None:
            raise RefusalError(
                "the record did not determine a model to simulate: identify another record, or "
                "fix the parameters that are missing"
            )
        return self.model

    @property
    def estimate(self) -> Estimate | None:
        """The published sweep, where it is the exhibit."""
        return self.exhibit if isinstance(self.exhibit, Estimate) else None

    @property
    def signature(self) -> ValveSignature | None:
        """The valve signature, where it is the exhibit."""
        return self.exhibit if isinstance(self.exhibit, ValveSignature) else None

    @property
    def drawing(self) -> Drawing:
        """Drawing of the evidence: the friction curve where there is one, or the exhibit."""
        own = self.exhibit and self.exhibit.drawing(self.parameters, self.valve)
        if FRICTION_CURVE not in self.evidence:
            return own or Drawing()
        return friction_drawing(
            own or Drawing(), self.evidence, self.parameters, self.model, self.sliding_speed
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the result as a mapping of plain values, SI units; None replaces nan and infinity.

        Every other rendering (JSON, rows, diagnostics, tables) is derived from this mapping. Its
        keys are stable: ``method``, ``parameters.<name>`` with ``value``, ``standard_error``,
        ``half_width``, ``interval``, ``verdict``, ``reason``, ``published`` and ``unit``;
        ``sliding_speed``, ``fit``, ``rms``, ``systematic_misfit``, ``model_describes``,
        ``derivative_window``, ``evidence``, ``settings`` and ``warnings``.
        """
        misfit, settings = self.misfit, self.settings
        return {
            "method": self.method,
            "parameters": {
                name: rendering.parameter_mapping(each) for name, each in self.parameters.items()
            },
            "sliding_speed": rendering.plain(self.sliding_speed),
            "fit": rendering.plain(self.fit),
            "rms": rendering.plain(self.rms),
            "systematic_misfit": None if misfit is None else rendering.plain(misfit.of_stem),
            "model_describes": None if misfit is None else misfit.describes,
            "derivative_window": self.derivative_window,
            "evidence": rendering.plain(self.evidence),
            "settings": {
                one.name: rendering.plain(getattr(settings, one.name)) for one in fields(settings)
            },
            "warnings": list(self.warnings),
        }

    def summary(self) -> str:
        """Return the result as a table of plain text, with reasons and warnings below it."""
        return rendering.text_of(self.to_dict(), self.findings)

    def __repr__(self) -> str:
        """Return method, friction and fit on one line."""
        one = self.parameters.get(SLIDING) or self.parameters["coulomb_friction"]
        name = one.name.replace("_", " ")
        known = f"{name} {with_width(one.value, one.half_width)} N ({one.verdict.value})"
        return f"<Result of method {self.method}, {known}, fit {100 * self.fit:.2f} %>"

    def __str__(self) -> str:
        """Return the table of the parameters."""
        return rendering.table_of(self.to_dict())

    def _repr_html_(self) -> str:
        """Return the table of the parameters as HTML, for a notebook."""
        return rendering.html_of(self.to_dict())

    def to_frame(self) -> "pd.DataFrame":
        """Return the parameters as a pandas frame, one row per parameter."""
        return rendering.frame_of(self.to_dict())

    def plot(self) -> "Figure":
        """Draw the record, the model's stem and the evidence of the method, as a matplotlib figure.

        A notebook shows it; ``savefig`` writes it.
        """
        from valve_friction_ros.figures import identification_figure  # noqa: PLC0415 - drawn above

        return identification_figure(self)


def _describes(result: Result) -> bool:
    return result.misfit is None or result.misfit.describes


def _free_parameters(result: Result) -> int:
    """Count the free parameters of the fit: those not given, and the imperfections tried."""
    found: Any = result.evidence.get(IMPERFECTIONS_FOUND, {})
    free = [name for name in result.parameters if name not in result.settings.fixed]
    return len(set(free) - {SLIDING, "limit_velocity"}) + len(found)
