"""What a report of an identification is made of."""

from dataclasses import dataclass, field

from valve_friction_ros.figures import PRESSURE, DriveScale
from valve_friction_ros.health import Baseline, Diagnosis, FrictionLimits, diagnose
from valve_friction_ros.identification import Result
from valve_friction_ros.model import Recording, Valve

__all__ = ["IdentifiedRecord"]


@dataclass(frozen=True, eq=False)
class IdentifiedRecord:
    """A record, what was identified from it, and what to judge it by.

    Attributes
    ----------
    name : str
        What to call the valve.
    source : str
        Where the record comes from.
    result : Result
        What was identified.
    baseline : Baseline or None
        Friction of the healthy valve.
    limits : FrictionLimits
        When friction is out of bounds.
    drive : DriveScale
        How the pressure is shown.
    notes : tuple of str
        What a reader of the result should know of the record, one sentence each.
    """

    name: str
    source: str
    result: Result = field(repr=False)
    baseline: Baseline | None = None
    limits: FrictionLimits = field(default_factory=FrictionLimits)
    drive: DriveScale = PRESSURE
    notes: tuple[str, ...] = ()

    @property
    def recording(self) -> Recording:
        """Pressure and stem position."""
        return self.result.recording

    @property
    def valve(self) -> Valve:
        """Geometry that it was identified with."""
        return self.result.valve

    @property
    def diagnosis(self) -> Diagnosis:
        """The verdict on the friction."""
        return diagnose(self.result, self.valve, self.baseline, self.limits)
