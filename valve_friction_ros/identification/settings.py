# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Settings of an identification, and the names and units of its parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from valve_friction_ros.model.checks import (
    frozen,
    require_finite,
    require_non_negative,
    require_positive,
    require_type,
    require_whole,
)

SLIDING = "sliding_friction"
"""Parameter name: ∫|F_friction|·|dx| / ∫|dx| over the record, N."""

CLOCK_OFFSET = "clock_offset"
"""Parameter name. Its value, s, is positive if the stem's time stamps are late."""

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "mass": "kg",
        "viscous_friction": "N·s/m",
        "coulomb_friction": "N",
        "static_friction": "N",
        "spring_constant": "N/m",
        "spring_preload": "N",
    }
)
"""Unit of each parameter of the Karnopp model, in the order in which they are shown."""

PARAMETER_UNITS: Mapping[str, str] = MappingProxyType(
    {
        **UNITS,
        "stribeck_velocity": "m/s",
        "coulomb_asymmetry": "1",
        "viscous_asymmetry": "1",
        CLOCK_OFFSET: "s",
        SLIDING: "N",
    }
)
"""Unit of every parameter that a result can hold; those after `UNITS` appear only if demanded."""

_SUFFIXES = {
    "kg": "_kg",
    "N": "_n",
    "N·s/m": "_n_s_per_m",
    "N/m": "_n_per_m",
    "m/s": "_m_per_s",
    "s": "_s",
}


def column_suffix(parameter: str) -> str:
    """Return the unit of a parameter as a column-name suffix; empty for a pure number."""
    return _SUFFIXES.get(PARAMETER_UNITS.get(parameter, ""), "")


PUBLISHED_WINDOW = 31
"""Derivative window d of the paper, samples (Appendix A)."""

REGRESSED = (
    "mass",
    "coulomb_friction",
    "viscous_friction",
    "spring_constant",
    "spring_preload",
)
"""Parameters of the regression: those of (3), and the preload F_0."""

FIXABLE = (*REGRESSED, "static_friction", "limit_velocity")
"""Parameters that can be fixed at a known value instead of being identified."""

STATED = ("spring_constant", "spring_preload", "mass")
"""Data-sheet parameters that can be compared with identified values."""

CALIBRATION: Mapping[str, str] = MappingProxyType(
    {
        "area_uncertainty": "the diaphragm area",
        "drive_scale_uncertainty": "the scale of the pressure (or force) sensor",
        "position_scale_uncertainty": "the scale of the position sensor",
    }
)
"""Settings that are relative standard uncertainties, and the quantity of each."""

METHOD_NAMES = ("plant", "bench", "published", "signature")
"""Names of the methods, in the order in which they are offered."""

DEFAULT_METHOD = "plant"

FORMER_METHODS: Mapping[str, str] = MappingProxyType(
    {
        "best": "plant",
        "robust": "plant",
        "refined": "bench",
        "sweep": "bench",
        "force_balance": "signature",
    }
)
"""Method names in files, settings and histories of earlier versions, and their current names."""

TIMING_UNCERTAINTY = 0.04
"""Default timing uncertainty of a plant, s.

Chosen: stamps, transmitters and tubing of a plant without special care add up to some tens of
milliseconds; 95 % are below 0.08 s."""

MOST_UNCERTAIN = 0.5
"""Relative standard uncertainty of a scale from which its 95 % interval includes zero."""

_MAY_BE_NEGATIVE = ("spring_preload",)
_POSITIVE = ("mass", "limit_velocity")


@dataclass(frozen=True)
class IdentificationSettings:
    """How a record is identified; the defaults are the paper's.

    Attributes
    ----------
    derivative_window : int, optional
        Length d of the derivative window, samples, odd (Appendix A). By default the published
        method takes the paper's, and the other methods choose it by the noise of the record.
    order : int
        Order n of the polynomial fitted to each window, at least 2 (Appendix A).
    steps : int
        Number S of thresholds δv in the sweep (8).
    resolution : int
        Divisor Z of the top speed in (8), above `steps`.
    fixed : mapping of str to float
        Known parameters by name (see `FIXABLE`); the regression leaves them out. Fixing
        ``limit_velocity`` sets the threshold δv instead of choosing it from the sweep.
    stated : mapping of str to float
        Values of a data sheet by name (see `STATED`). They take no part in the identification: a
        found value that contradicts one gives a warning with the likely cause. Fixed parameters
        are not compared.
    assumed : tuple of str
        Fields of the `Valve` that were assumed, not stated: the result says so, and a number that
        depends on an assumed area or pressure reference is weak at most.
    position_bias : float, optional
        Bias x̄ of (10), m. If it is given, the methods ``published`` and ``signature`` use the
        paper's form with four columns, F_0 = k·x̄; by default, and in the other methods, the
        preload is identified.
    assumed_mass : float
        Mass, kg, above zero; used where the record does not determine the mass.
    timing_uncertainty : float, optional
        Standard deviation, s, of the whole time by which one signal may lag the other: clocks,
        damping of transmitters, a volume before the diaphragm. Used by the methods ``plant``
        (default 0.04 s, a plant without special care) and ``bench`` (default zero: on a bench the
        signals are clearly synchronous).
    area_uncertainty, drive_scale_uncertainty, position_scale_uncertainty : float
        Relative standard uncertainties (GUM), 0.02 for 2 %, of the diaphragm area, of the scale of
        the pressure sensor (for a drive that is a force: of the force sensor), and of the scale of
        the position sensor; from 0, the default, to below 0.5. They widen the intervals of every
        method. A common scale cancels in the ratio to the baseline, so they are left out there.

    Raises
    ------
    ValueError
        If a setting is impossible; the message names it.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> vf.IdentificationSettings(fixed={"mass": 1.6}).fixed["mass"]
    1.6
    >>> vf.IdentificationSettings(derivative_window=30)
    Traceback (most recent call last):
        ...
    ValueError: derivative_window must be odd and at least order + 2 = 5, got 30
    """

    derivative_window: int | None = None
    order: int = 3
    steps: int = 330
    resolution: int = 350
    fixed: Mapping[str, float] = field(default_factory=dict)
    position_bias: float | None = None
    assumed_mass: float = 1.0
    timing_uncertainty: float | None = None
    area_uncertainty: float = 0.0
    drive_scale_uncertainty: float = 0.0
    position_scale_uncertainty: float = 0.0
    stated: Mapping[str, float] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse settings that contradict each other."""
        for name in ("order", "steps", "resolution"):
            require_whole(name, getattr(self, name))
        if self.order < 2:
            raise ValueError(f"order must be at least 2 for an acceleration, got {self.order}")
        window = require_whole("derivative_window", self.published_window)
        if window % 2 == 0 or window < self.order + 2:
            raise ValueError(
                f"derivative_window must be odd and at least order + 2 = {self.order + 2}, "
                f"got {window}"
            )
        if not 0 < self.steps < self.resolution:
            raise ValueError(
                f"steps ({self.steps}) must be above zero and below resolution ({self.resolution})"
            )
        require_positive("assumed_mass", self.assumed_mass)
        if self.timing_uncertainty is not None:
            require_non_negative("timing_uncertainty", self.timing_uncertainty)
        for name in CALIBRATION:
            given = getattr(self, name)
            if isinstance(given, str) or not 0 <= given < MOST_UNCERTAIN:
                raise ValueError(
                    f"{name} must be at least 0 and below {MOST_UNCERTAIN:g}, got {given}: "
                    "give a share, 0.02 for 2 %"
                )
        object.__setattr__(self, "fixed", frozen(_checked(self.fixed, FIXABLE, "fixed")))
        stated = _checked(self.stated, STATED, "stated")
        stated = {name: value for name, value in stated.items() if name not in self.fixed}
        object.__setattr__(self, "stated", frozen(stated))
        if self.position_bias is not None:
            require_finite("position_bias", self.position_bias)
            if "spring_preload" in self.fixed:
                raise ValueError("position_bias and a fixed spring_preload exclude each other")

    @property
    def published_window(self) -> int:
        """Derivative window of the published method, samples."""
        return PUBLISHED_WINDOW if self.derivative_window is None else self.derivative_window


def current_name(method: str) -> str:
    """Return the current name of a method; other names are returned unchanged."""
    return FORMER_METHODS.get(method, method)


def _checked(values: Mapping[str, float], names: tuple[str, ...], what: str) -> dict[str, float]:
    """Return the values of parameters, checked to be finite and of the right sign."""
    require_type(what, values, "names and values, such as {'mass': 1.6}", Mapping)
    checked = {}
    for name, value in values.items():
        if name not in names:
            raise ValueError(
                f"{name!r} is not a parameter that can be {what}: choose from {', '.join(names)}"
            )
        if name in _MAY_BE_NEGATIVE:
            checked[name] = require_finite(name, value)
        elif name in _POSITIVE:
            checked[name] = require_positive(name, value)
        else:
            checked[name] = require_non_negative(name, value)
    return checked
