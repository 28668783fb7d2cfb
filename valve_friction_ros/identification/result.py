"""The result: what every method of identification returns."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification import rendering
from valve_friction_ros.identification.drawing import Drawing, Exhibit
from valve_friction_ros.identification.published.estimate import Estimate
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.signature.valve_signature import ValveSignature
from valve_friction_ros.identification.trust.calibration import with_calibration
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.stated import CONTRADICTED, with_stated
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.frozen import frozen
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

__all__ = ["Result", "StemComparison"]


class StemComparison(NamedTuple):
    """Measured position, as the identification took it, and the model's, m, shape (m,) each."""

    sample_period: float
    measured: NDArray[np.float64]
    simulated: NDArray[np.float64]

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample since the first one, s, shape (m,)."""
        return np.arange(self.measured.size, dtype=np.float64) * self.sample_period

    @property
    def residual(self) -> NDArray[np.float64]:
        """Simulated minus measured position, m, shape (m,)."""
        return self.simulated - self.measured

    def autocorrelation(self, lags: int) -> NDArray[np.float64]:
        """Return the autocorrelation of the residual at lags of 0 … `lags` − 1 samples.

        It is 1 at lag 0; a residual of zeros gives 0 at every lag.
        """
        residual = self.residual - self.residual.mean()
        size = 2 * residual.size
        spectrum = np.abs(np.fft.rfft(residual, size)) ** 2
        products = np.fft.irfft(spectrum, size)[:lags]
        power = float(products[0])
        return np.asarray(products / (power or 1.0), dtype=np.float64)


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
        By name: those of `UNITS`, the extensions that the record demanded, `sliding_friction`. The
        uncertainties of area and sensor scales in `settings` are in their intervals, and what its
        stated values contradict is weak at most.
    fit : float
        Share of the stem's movement that the model reproduces, at most 1; of the force where no
        stem is simulated.
    rms : float
        Root mean square of simulated minus measured position, m; nan where no stem is simulated.
    misfit : Misfit or None
        A test of the model, by the stem or, without a spring, by the force; None in a method
        without one.
    derivative_window : int
        Derivative window that was used, samples; 0 in a method without derivatives.
    warnings : tuple of str
        Limitations of the numbers, one sentence each.
    evidence : mapping of str to object
        Further values of the method, by name, SI units.
    findings : tuple of str
        The evidence in words, one sentence each.
    model : KarnoppParameters or None
        The identified model, to simulate; None where a value is impossible.
    exhibit : Exhibit or None
        What figures and reports draw beside record and stem, such as a sweep or a valve signature.
    stem : StemComparison or None
        Measured and simulated stem; None where no stem is simulated.
    sliding_speed : float
        Mean speed of the stem over the distance, ∫|v|·|dx| / ∫|dx|, m/s: the speed that
        `sliding_friction` belongs to; nan where it is unknown.

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
    exhibit: Exhibit | None = field(default=None, repr=False)
    stem: StemComparison | None = field(default=None, repr=False)
    sliding_speed: float = math.nan

    def __post_init__(self) -> None:
        """Apply calibration and stated values, for every method; freeze the mappings."""
        parameters, evidence = with_calibration(
            self.parameters, self.evidence, self.settings, self.recording.driven_by
        )
        parameters, told, sentences = with_stated(
            parameters, self.settings.stated, self.valve, self.recording
        )
        if told:
            evidence[CONTRADICTED] = told
        new = (each for each in sentences if each not in self.warnings)
        object.__setattr__(self, "warnings", (*new, *self.warnings))
        object.__setattr__(self, "parameters", frozen(parameters))
        object.__setattr__(self, "evidence", frozen(evidence))

    @property
    def values(self) -> dict[str, float]:
        """The identified values by name; nan where a parameter is not identifiable."""
        return {name: parameter.value for name, parameter in self.parameters.items()}

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
        """What is drawn of the exhibit."""
        if self.exhibit is None:
            return Drawing()
        return self.exhibit.drawing(self.parameters, self.valve)

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
        """Return method, Coulomb friction and fit on one line."""
        friction = self.parameters.get("coulomb_friction")
        known = "" if friction is None else f", {friction.value:.6g} N ({friction.verdict.value})"
        return f"<Result of method {self.method}{known}, fit {100 * self.fit:.2f} %>"

    def __str__(self) -> str:
        """Return the table of the parameters."""
        return rendering.table_of(self.to_dict())

    def _repr_html_(self) -> str:
        """Return the table of the parameters as HTML, for a notebook."""
        return rendering.html_of(self.to_dict())

    def to_frame(self) -> "pd.DataFrame":
        """Return the parameters as a pandas frame, one row per parameter.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        return rendering.frame_of(self.to_dict())

    def plot(self) -> "Figure":
        """Draw the record, the model's stem and the evidence of the method.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it; ``savefig`` writes it.
        """
        from valve_friction_ros.figures import identification_figure  # noqa: PLC0415 - drawn above

        return identification_figure(self)
