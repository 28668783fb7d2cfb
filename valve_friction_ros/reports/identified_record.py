"""What a report of an identification is made of."""

from dataclasses import dataclass, field

from valve_friction_ros.figures import PRESSURE, DriveScale
from valve_friction_ros.health import Baseline, Diagnosis, FrictionLimits, diagnose
from valve_friction_ros.identification import Assessment, IdentificationSettings
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
    recording : Recording
        Pressure and stem position.
    valve : Valve
        Geometry that it was identified with.
    assessment : Assessment
        What came of it.
    settings : IdentificationSettings
        How it was identified.
    derivative_window : int or None
        Derivative window that was asked for, samples; None: the noise of the record chose it.
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
    recording: Recording = field(repr=False)
    valve: Valve
    assessment: Assessment = field(repr=False)
    settings: IdentificationSettings
    derivative_window: int | None = None
    baseline: Baseline | None = None
    limits: FrictionLimits = field(default_factory=FrictionLimits)
    drive: DriveScale = PRESSURE
    notes: tuple[str, ...] = ()

    @property
    def diagnosis(self) -> Diagnosis:
        """The verdict on the friction."""
        return diagnose(self.assessment, self.valve, self.baseline, self.limits)
