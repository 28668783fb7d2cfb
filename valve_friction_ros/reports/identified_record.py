"""The content of a report of an identification."""

from dataclasses import dataclass, field

from valve_friction_ros.health import Baseline, Diagnosis, FrictionLimits, diagnose
from valve_friction_ros.history import ValveHistory
from valve_friction_ros.identification import Result
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.usage import ValveUsage

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

    @property
    def recording(self) -> Recording:
        """Drive and stem position."""
        return self.result.recording

    @property
    def valve(self) -> Valve:
        """Geometry of the valve."""
        return self.result.valve

    @property
    def diagnosis(self) -> Diagnosis:
        """The diagnosis of the valve."""
        return diagnose(self.result, self.valve, self.baseline, self.limits)
