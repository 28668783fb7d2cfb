# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The baseline: friction and other measured numbers of the healthy valve."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_numbers import valve_numbers
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.checks import equal_by_fields, require_non_negative, require_positive
from valve_friction_ros.wording import (
    MORE_STROKES,
    Code,
    Statement,
    lack_words,
    name_in_words,
    said,
    sentence,
)

GOOD_SHARE, LARGEST_SHARE = 0.13, 0.33
"""Largest half width of a friction, over its value, in a good baseline and in any baseline.

A friction known to the same share is declared grown when it has grown by half, or when it has
doubled: ln(1.5/1.25)/√2 and ln(2/1.25)/√2, with the 1.25 of `FrictionLimits`."""

_OTHER_METHOD = "use a method that gives confidence intervals"


class Lack(Enum):
    """What a baseline lacks."""

    RESULT = "no result"
    VALUE = "no value"
    SIZE = "not above zero"
    INTERVAL = "no interval"
    PRECISION = "interval too wide"
    HEALTH = "in alarm"


@equal_by_fields
@dataclass(frozen=True)
class BaselineLack:
    """An unmet condition of a baseline.

    Attributes
    ----------
    of : str
        What fails the condition: ``coulomb_friction``, ``sliding_friction``, ``moves`` in service,
        the ``result`` or the ``valve``.
    lack : Lack
        What is missing.
    share, largest : float
        Half width over the value, and its limit; nan where the precision is not the problem.
    """

    of: str
    lack: Lack
    share: float = math.nan
    largest: float = math.nan

    @property
    def words(self) -> str:
        """What is missing, in words."""
        return lack_words(self.of, self.lack.name, self.share, self.largest)

    @classmethod
    def found(cls, of: str, one: Parameter, largest: float) -> "BaselineLack | None":
        """Return what a friction lacks to be known to the share `largest`, or None."""
        if math.isnan(one.value):
            return cls(of, Lack.VALUE)
        if one.value <= 0:
            return cls(of, Lack.SIZE)
        if math.isnan(one.half_width):
            return cls(of, Lack.INTERVAL)
        if one.half_width > largest * one.value:
            return cls(of, Lack.PRECISION, one.half_width / one.value, largest)
        return None


class BaselineRefusalError(RefusalError):
    """Refusal of a baseline; the message names cause and remedy.

    Attributes
    ----------
    lacks : tuple of BaselineLack
        The unmet conditions.
    """

    def __init__(self, message: str, *lacks: BaselineLack) -> None:
        super().__init__(message)
        self.lacks = lacks


@equal_by_fields
@dataclass(frozen=True)
class SlidingFriction:
    """Friction work per distance of sliding, with the speed at which it was measured.

    Attributes
    ----------
    value : float
        ∫|F_friction|·|dx| / ∫|dx|, N, above zero.
    half_width : float
        Half the width of its 95 % interval, N.
    speed : float
        Mean speed over the distance, ∫|v|·|dx| / ∫|dx|, m/s, above zero.
    """

    value: float
    half_width: float
    speed: float

    def __post_init__(self) -> None:
        require_positive("sliding_friction", self.value)
        require_non_negative("half_width", self.half_width)
        require_positive("sliding_speed", self.speed)

    @property
    def share(self) -> float:
        """Half width over the value."""
        return self.half_width / self.value

    def __str__(self) -> str:
        """Return value, half width and speed."""
        return str(said(Code.SLIDING_SIZE, **vars(self)))


@equal_by_fields
@dataclass(frozen=True)
class Baseline:
    """The healthy valve: Coulomb friction, sliding friction or both, and its other numbers.

    The intervals leave out the uncertainties of area and sensor scales: these cancel in the ratio
    of two frictions measured by the same sensors.

    Attributes
    ----------
    coulomb_friction : float or None
        F_c, N, above zero.
    half_width : float
        Half the width of its 95 % interval, N; zero for an exact value.
    sliding : SlidingFriction or None
        The sliding friction, which needs no split into F_c and F_v.
    numbers : mapping of str to Measured
        Further numbers of the valve from the same result (`valve_numbers`); empty for a friction
        alone. Equality of baselines ignores them: the frictions distinguish results.

    Raises
    ------
    ValueError
        If a value is impossible, or no friction is given.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> healthy = vf.Baseline(coulomb_friction=150.0, half_width=2.0)
    >>> print(healthy)
    Coulomb friction 150.0 ± 2.0 N
    """

    coulomb_friction: float | None = None
    half_width: float = 0.0
    sliding: SlidingFriction | None = None
    numbers: Mapping[str, Measured] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if self.coulomb_friction is not None:
            require_positive("baseline_coulomb_friction", self.coulomb_friction)
        elif self.sliding is None:
            raise ValueError("a baseline needs a Coulomb friction or a sliding friction")
        require_non_negative("half_width", self.half_width)

    @property
    def statement(self) -> Statement:
        """Its frictions."""
        found = []
        if (value := self.coulomb_friction) is not None:
            found.append(said(Code.BASELINE_COULOMB, value=value, half_width=self.half_width))
        if self.sliding is not None:
            found.append(said(Code.BASELINE_SLIDING, **vars(self.sliding)))
        return said(Code.BASELINE, frictions=tuple(found))

    def __str__(self) -> str:
        """Return its frictions on one line."""
        return sentence(self.statement)

    @property
    def remark(self) -> str:
        """The growth of friction that is sure to be declared, where it exceeds half; else ''."""
        shares = [] if self.sliding is None else [self.sliding.share]
        if self.coulomb_friction is not None:
            shares.append(self.half_width / self.coulomb_friction)
        share = min(shares)
        if share <= GOOD_SHARE:
            return ""
        least = 1.5 * math.exp(math.sqrt(2.0) * (share - GOOD_SHARE))
        return sentence(said(Code.BASELINE_REMARK, share=share, least=least))

    @classmethod
    def of(cls, result: Result) -> "Baseline":
        """Return a baseline of the frictions that a result knows well enough (`serving`).

        Raises BaselineRefusalError, with the reasons, if neither friction is known well enough.
        """
        frictions = _frictions(result)
        lacks = _lacks(frictions)
        for one in frictions.values():
            if one.value < 0:
                raise BaselineRefusalError(
                    f"a {name_in_words(one.name)} of {one.value:.4g} N cannot be a baseline: "
                    "check the direction of both signals, then identify again",
                    BaselineLack(one.name, Lack.SIZE),
                )
        known = {
            name: Measured(one.value, one.half_width)
            for name, one in frictions.items()
            if name not in lacks
        }
        slid = known.get(SLIDING)
        sliding = (
            None
            if slid is None
            else SlidingFriction(slid.value, slid.half_width, result.sliding_speed)
        )
        found = cls.serving(known.get("coulomb_friction"), sliding, valve_numbers(result))
        if found is None:
            why_not = "; ".join(_why_not(frictions[name], one) for name, one in lacks.items())
            without = all(math.isnan(one.half_width) for one in frictions.values())
            has_value = any(not math.isnan(one.value) for one in frictions.values())
            remedy = _OTHER_METHOD if without and has_value else MORE_STROKES
            raise BaselineRefusalError(
                f"this result cannot be the baseline: {why_not}: {remedy}", *lacks.values()
            )
        return found

    @staticmethod
    def lacks(result: Result) -> tuple[BaselineLack, ...]:
        """Return the conditions of a baseline that a result fails; empty if `of` accepts it."""
        frictions = _frictions(result)
        wrong = [one.name for one in frictions.values() if one.value < 0]
        if wrong:
            return (BaselineLack(wrong[0], Lack.SIZE),)
        found = _lacks(frictions)
        return tuple(found.values()) if len(found) == len(frictions) else ()

    @classmethod
    def serving(
        cls,
        coulomb: Measured | None,
        sliding: SlidingFriction | None,
        numbers: Mapping[str, Measured],
    ) -> "Baseline | None":
        """Return a baseline of the frictions that are known well enough, or None.

        It takes each friction known to `GOOD_SHARE`. If neither is, it takes one known to
        `LARGEST_SHARE`, preferably the sliding friction.
        """
        for largest in (GOOD_SHARE, LARGEST_SHARE):
            slid = sliding if sliding is not None and sliding.share <= largest else None
            dry = coulomb if coulomb is not None and coulomb.share <= largest else None
            if slid is not None and largest == LARGEST_SHARE:
                dry = None
            if slid is not None or dry is not None:
                value, width = (None, 0.0) if dry is None else (dry.value, dry.half_width)
                return cls(value, width, slid, numbers)
        return None


def _frictions(result: Result) -> dict[str, Parameter]:
    names = ["coulomb_friction"]
    if SLIDING in result.parameters and result.sliding_speed > 0:
        names.append(SLIDING)
    return {name: result.parameters[name].without_calibration for name in names}


def _lacks(frictions: Mapping[str, Parameter]) -> dict[str, BaselineLack]:
    found = {name: BaselineLack.found(name, one, LARGEST_SHARE) for name, one in frictions.items()}
    return {name: one for name, one in found.items() if one is not None}


def _why_not(friction: Parameter, lack: BaselineLack) -> str:
    name = name_in_words(friction.name)
    if lack.lack is Lack.VALUE:
        return f"{name} is not identifiable ({friction.reason})"
    if lack.lack is Lack.SIZE:
        return f"{name} is {friction.value:.4g} N"
    return lack.words
