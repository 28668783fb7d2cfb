"""The content of a report of an identification."""

from dataclasses import dataclass, field
from functools import cached_property

from valve_friction_ros.health import (
    Baseline,
    Change,
    Diagnosis,
    Finding,
    FrictionLimits,
    KnownNumbers,
    Measured,
    ValveLimits,
    by_severity,
    diagnose,
    explains,
    qualified,
    valve_numbers,
)
from valve_friction_ros.history import ValveHistory
from valve_friction_ros.identification import Result
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.response import ResponseSummary
from valve_friction_ros.usage import LimitState, ValveUsage

__all__ = ["IdentifiedRecord"]


@dataclass(frozen=True, eq=False)
class IdentifiedRecord:
    """A record, its result, and the baseline and limits for its diagnosis.

    Attributes
    ----------
    name : str
        Name of the valve.
    source : str
        Source of the record.
    result : Result
        Result of the identification.
    baseline : Baseline or None
        Friction of the healthy valve.
    limits : FrictionLimits
        Bounds of the friction.
    notes : tuple of str
        Limitations of the record, one sentence each.
    dated : str
        Further date, such as that of the file or of the identification, in words.
    healthy : Recording or None
        Record of the baseline, to be drawn beside this one.
    history : ValveHistory or None
        What was identified of this valve before.
    usage : ValveUsage
        What the valve has done.
    response : ResponseSummary or None
        Its answers to steps of its command.
    usage_limits : tuple of LimitState or None
        How far the packing is from its limits; None where they are not known.
    valve_limits : ValveLimits
        Bounds of what else may change on the valve.
    known : KnownNumbers or None
        What is known of the valve, also by earlier records; None: by the result alone.
    """

    name: str
    source: str
    result: Result = field(repr=False)
    baseline: Baseline | None = None
    limits: FrictionLimits = field(default_factory=FrictionLimits)
    notes: tuple[str, ...] = ()
    dated: str = ""
    healthy: Recording | None = field(default=None, repr=False)
    history: ValveHistory | None = field(default=None, repr=False)
    usage: ValveUsage = field(default_factory=ValveUsage, repr=False)
    response: ResponseSummary | None = field(default=None, repr=False)
    usage_limits: tuple[LimitState, ...] | None = None
    valve_limits: ValveLimits = field(default_factory=ValveLimits)
    known: KnownNumbers | None = field(default=None, repr=False)

    @property
    def recording(self) -> Recording:
        """Drive and stem position."""
        return self.result.recording

    @property
    def valve(self) -> Valve:
        """Geometry of the valve."""
        return self.result.valve

    @property
    def _friction(self) -> Diagnosis:
        return diagnose(self.result, self.valve, self.baseline, self.limits)

    @property
    def _factor(self) -> Change | None:
        return self._known.common_factor(self.baseline, self.valve_limits)

    @property
    def diagnosis(self) -> Diagnosis:
        """The diagnosis of the valve."""
        return qualified(self._friction, self._factor, self.valve)

    @property
    def is_scaled(self) -> bool:
        """Whether one factor explains what is found on friction and spring together."""
        return explains(self._factor, self._friction)

    @cached_property
    def _known(self) -> KnownNumbers:
        return self.known or KnownNumbers().followed_by(valve_numbers(self.result), 0)

    @property
    def numbers(self) -> dict[str, Measured]:
        """What is known of the valve beside its friction."""
        return self._known.numbers

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What has changed on the valve beside its friction, the most severe first."""
        return tuple(
            by_severity(self._known.findings(self.baseline, self.valve, self.valve_limits))
        )
