# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts on identified numbers, their uncertainty by area and sensor scales, and the misfit."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING

from valve_friction_ros.identification.settings import PARAMETER_UNITS, IdentificationSettings
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.wording import misfit_words, percentage, two_digits

FALL_SPEED = 6.5e-3
"""Speed, m/s, up to which friction may fall: twice the v_s = 3.26 mm/s published for graphite.

At 2·v_s the fall is complete except for e⁻⁴ = 2 %. A slower record does not separate F_c from the
friction at low speed. An absolute value from one packing, applied to every valve."""

NO_SLIP = "the record shows no slip jump: F_s cannot be separated from F_c"
"""Reason of a static friction that is not identifiable."""


WEAK_SHARE = 0.05
"""Half width of an interval, as a share of the value, above which the verdict is weak.

Chosen: a fifth of the 25 % growth of F_c that raises the first alarm (`FrictionLimits`)."""


PRELOAD_SCALE = 0.12
"""Least size by which the interval of a preload is judged, as a share of the actuator force range.

A preload may well be zero, so its interval is judged by what depends on it, the balance of spring
and actuator: `WEAK_SHARE` of this is 0.6 % of the range, a fifth of the smallest shift that is
found (`ValveLimits.preload_change`)."""


class Verdict(Enum):
    """Whether an identified number can be used."""

    IDENTIFIED = "identified"
    WEAK = "weak"
    NOT_IDENTIFIABLE = "not identifiable"
    FIXED = "fixed"


@equal_by_fields
@dataclass(frozen=True)
class Parameter:
    """A parameter with its interval and its verdict.

    Attributes
    ----------
    name : str
        Name of the parameter.
    value : float
        Its value, SI unit; nan where it is not identifiable.
    standard_error : float
        Standard error, SI unit; 0 where it is fixed, nan where it is not identifiable.
    half_width : float
        Half the width of its 95 % interval.
    verdict : Verdict
        Whether the value can be used.
    reason : str
        Why the value is weak or not identifiable; else empty.
    withheld : tuple of float
        Value and half width that were withheld because the interval is wider than the value, SI
        unit; else nan.
    published : float
        Estimate of the published method, SI unit; nan where that method refused the record.
    uncalibrated : Parameter or None
        The parameter before the uncertainty of area and sensor scales widened its interval, and
        before stated values put the scale in doubt; None where neither happened.
    """

    name: str
    value: float
    standard_error: float
    half_width: float
    verdict: Verdict
    reason: str = ""
    withheld: tuple[float, float] = (math.nan, math.nan)
    published: float = math.nan
    uncalibrated: "Parameter | None" = field(default=None, repr=False)

    @property
    def magnitude_bound(self) -> float:
        """Largest magnitude in the interval of a withheld value, SI unit; else nan."""
        value, half_width = self.withheld
        return abs(value) + half_width

    @property
    def without_calibration(self) -> "Parameter":
        """The parameter without calibration uncertainty, to compare with one of the same sensors.

        Errors of area and sensor scales are common to both and cancel in their ratio.
        """
        return self.uncalibrated or self

    @property
    def unit(self) -> str:
        """SI unit, as text."""
        return PARAMETER_UNITS.get(self.name, "")

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval."""
        return self.value - self.half_width, self.value + self.half_width


def share_of(value: float, half_width: float, scale: float = 0.0) -> float:
    """Return a half width as a share of a value, or of a scale where that is larger."""
    size = max(abs(value), scale)
    return half_width / size if size else math.inf


def interval_share(value: float, share: float, scale: float = 0.0) -> str:
    """Express an interval in words, as a share of its value or of the scale used in its place."""
    if abs(value) >= scale:
        return f"±{percentage(share)} of its value"
    return f"±{percentage(share * PRELOAD_SCALE)} of the range of the actuator force"


def with_verdict(
    name: str,
    value: float,
    standard_error: float,
    half_width: float,
    doubt: str = "",
    scale: float = 0.0,
) -> Parameter:
    """Give a value its verdict: weak beyond `WEAK_SHARE`, not identifiable beyond the value itself.

    A `doubt` is a reason why the value is at most weak, however narrow its interval is; without one
    the width of the interval is the reason. `scale` is the least size, SI unit, by which the
    interval is judged where the value may be zero.
    """
    share = share_of(value, half_width, scale)
    if share <= WEAK_SHARE and not doubt:
        return Parameter(name, value, standard_error, half_width, Verdict.IDENTIFIED)
    if share < 1:
        reason = doubt or f"its interval is {interval_share(value, share, scale)}"
        return Parameter(name, value, standard_error, half_width, Verdict.WEAK, reason)
    reason = doubt or "its interval is wider than its value"
    return replace(not_identifiable(name, reason), withheld=(value, half_width))


def not_identifiable(name: str, reason: str) -> Parameter:
    """Withhold a value that the record does not determine, with the reason."""
    return Parameter(name, math.nan, math.nan, math.nan, Verdict.NOT_IDENTIFIABLE, reason)


def fixed(name: str, value: float, reason: str = "given") -> Parameter:
    """Return a parameter with a value that was given."""
    return Parameter(name, value, 0.0, 0.0, Verdict.FIXED, reason)


BUDGET = "uncertainty_budget"
"""Name of the evidence that splits the standard uncertainty of each parameter by its sources."""

_EXPONENTS: Mapping[str, tuple[int, int]] = {
    "mass": (1, -1),
    "viscous_friction": (1, -1),
    "coulomb_friction": (1, 0),
    "static_friction": (1, 0),
    "sliding_friction": (1, 0),
    "spring_constant": (1, -1),
    "spring_preload": (1, 0),
    "stribeck_velocity": (0, 1),
    "limit_velocity": (0, 1),
}
"""Powers of the force and length scales with which a parameter grows; 0 for all others."""

OF_FORCE = frozenset(name for name, (force, _) in _EXPONENTS.items() if force)
"""Parameters that grow with the scale of the forces."""

COVERAGE = 2.0
"""Half width of a 95 % interval over the standard uncertainty (GUM, k = 2)."""


def calibration_share(name: str, settings: IdentificationSettings, driven_by: Drive) -> float:
    """Return the relative standard uncertainty of a parameter due to calibration.

    A parameter is a product of powers of the scales, so that their relative uncertainties, each
    times its power, add in squares (GUM 5.1.6). Area and pressure set the scale of a force; a
    drive that is a force has only the scale of its sensor. A preload from a known bias is k·x̄.
    """
    if name == "spring_preload" and settings.position_bias is not None:
        name = "spring_constant"
    force, length = _EXPONENTS.get(name, (0, 0))
    area = settings.area_uncertainty if driven_by is Drive.PRESSURE else 0.0
    return math.hypot(
        force * area,
        force * settings.drive_scale_uncertainty,
        length * settings.position_scale_uncertainty,
    )


def calibrated(one: Parameter, share: float) -> Parameter:
    """Widen the interval of an estimate by a relative standard uncertainty of its scale.

    Both are independent, and add in squares. The verdict follows from the wider interval; since the
    record still determines the value, the verdict is never worse than weak. A given value, or one
    without an interval, is returned unchanged.
    """
    error = share * abs(one.value)
    is_estimate = one.half_width >= 0 and one.verdict is not Verdict.FIXED
    if not (error > 0 and is_estimate) or one.uncalibrated is not None:
        return one
    width = math.hypot(one.half_width, COVERAGE * error)
    wide = width / abs(one.value)
    verdict, reason = one.verdict, one.reason
    if wide > WEAK_SHARE:
        verdict = Verdict.WEAK
        told = f"with the calibration uncertainty its interval is ±{percentage(wide)} of its value"
        reason = f"{reason}; {told}" if reason else told
    return replace(
        one,
        standard_error=math.hypot(one.standard_error, error),
        half_width=width,
        verdict=verdict,
        reason=reason,
        uncalibrated=one,
    )


def with_calibration(
    parameters: Mapping[str, Parameter],
    evidence: Mapping[str, object],
    settings: IdentificationSettings,
    driven_by: Drive,
) -> tuple[dict[str, Parameter], dict[str, object]]:
    """Return parameters with the calibration in their intervals, and evidence with its budget.

    A method without a budget gets one if there is a calibration uncertainty: the standard error
    is the share of the record. A parameter that has been widened before is not widened again.
    """
    shares = {name: calibration_share(name, settings, driven_by) for name in parameters}
    found = {name: calibrated(one, shares[name]) for name, one in parameters.items()}
    told = evidence.get(BUDGET)
    budget = dict(told) if isinstance(told, Mapping) else {}
    if not budget and any(shares.values()):
        budget = {
            name: {"record": one.without_calibration.standard_error}
            for name, one in found.items()
            if one.standard_error > 0
        }
    for name, sources in budget.items():
        one = found.get(name)
        error = 0.0 if one is None or one.uncalibrated is None else shares[name] * abs(one.value)
        budget[name] = {**sources, "calibration": error}
    return found, {**evidence, BUDGET: budget} if budget else dict(evidence)


if TYPE_CHECKING:
    from valve_friction_ros.model.valve import Valve

LEAST_FIT = 0.9
"""Share of the movement below which a model that does not describe the record is refused.

Chosen below all simulated records, which have 0.96 and more, except in-service records of graphite
at 100 Hz (0.84)."""


@equal_by_fields
@dataclass(frozen=True)
class Misfit:
    """How well the simulated stem follows the measured one, or the modelled force the measured.

    Attributes
    ----------
    fit : float
        Share of the movement that is reproduced, at most 1.
    rms, systematic, tolerated : float
        Root mean square of the whole residual, sensor noise included; its part that this noise does
        not explain; and the largest such part that leaves the model without doubt, `unit`.
    unit : str
        ``m``; ``N`` where no stem is simulated.
    """

    fit: float
    rms: float
    systematic: float
    tolerated: float
    unit: str = "m"

    @property
    def of_stem(self) -> float:
        """The systematic misfit of a simulated stem, m; nan where no stem is simulated."""
        return self.systematic if self.unit == "m" else math.nan

    @property
    def words(self) -> str:
        """The systematic misfit with its unit, as text."""
        return misfit_words(self.systematic, self.unit)

    @property
    def is_gross(self) -> bool:
        """Whether the model reproduces too little of the movement for any parameter to be used."""
        return self.fit < LEAST_FIT and not self.describes

    @property
    def describes(self) -> bool:
        """Whether the model describes the valve."""
        return self.systematic <= self.tolerated


def stem_distance(rms: float, valve: "Valve") -> str:
    """Write the distance of simulated and measured stem, in micrometres and percent of travel."""
    share = valve.share_of_travel(rms)
    of_travel = f", {percentage(share)} of travel" if math.isfinite(share) else ""
    return f"{two_digits(rms * 1e6)} µm rms{of_travel}"
