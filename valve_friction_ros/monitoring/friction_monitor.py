"""The monitor of one valve, without any ROS: gather, identify, remember, judge."""

from dataclasses import dataclass, field

from valve_friction_ros.identification.estimate import Estimate
from valve_friction_ros.identification.identify import identify
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.model.checks import require_positive
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.monitoring.diagnosis import (
    Diagnosis,
    FrictionLimits,
    Level,
    StatusSignal,
    diagnose,
)
from valve_friction_ros.monitoring.record_buffer import RecordBuffer, Snapshot

__all__ = ["FrictionMonitor", "MonitorSettings", "identify_snapshot"]


@dataclass(frozen=True)
class MonitorSettings:
    """What a monitor needs to know about its valve and its task.

    Attributes
    ----------
    valve : Valve
        Geometry and sensor range.
    identification : IdentificationSettings
        How records are identified.
    limits : FrictionLimits
        When friction is out of bounds.
    baseline : float or None
        Coulomb friction of the healthy valve, N, where it is known beforehand.
    window : float
        Length of the record that is kept and identified, s.
    """

    valve: Valve
    identification: IdentificationSettings = field(default_factory=IdentificationSettings)
    limits: FrictionLimits = field(default_factory=FrictionLimits)
    baseline: float | None = None
    window: float = 60.0

    def __post_init__(self) -> None:
        """Refuse a window or a baseline that cannot be."""
        require_positive("window", self.window)
        if self.baseline is not None:
            require_positive("baseline_coulomb_friction", self.baseline)


def identify_snapshot(snapshot: Snapshot, settings: MonitorSettings) -> Estimate:
    """Identify a snapshot of the buffer; needs nothing of the monitor, so any thread may run it.

    Raises
    ------
    RefusalError
        With the cause, and why the buffer was emptied if that is recent.
    """
    try:
        return identify(snapshot.recording(), settings.valve, settings.identification)
    except RefusalError as refusal:
        if snapshot.cleared_because is None:
            raise
        raise RefusalError(
            f"{refusal} (the buffer was cleared: {snapshot.cleared_because})"
        ) from refusal


class FrictionMonitor:
    """Watches one valve.

    Parameters
    ----------
    settings : MonitorSettings
        Valve, identification, limits, baseline and window.
    """

    def __init__(self, settings: MonitorSettings) -> None:
        self._settings = settings
        self._baseline = settings.baseline
        self._estimate: Estimate | None = None
        self._estimate_stamp: int | None = None
        self._refusal: str | None = None
        self.buffer = RecordBuffer(settings.valve, settings.window)

    @property
    def settings(self) -> MonitorSettings:
        """The settings in force."""
        return self._settings

    @property
    def baseline(self) -> float | None:
        """Coulomb friction to compare with, N."""
        return self._baseline

    @property
    def estimate(self) -> Estimate | None:
        """The latest estimate; a refusal leaves the one before it in place."""
        return self._estimate

    @property
    def estimate_stamp(self) -> int | None:
        """When the latest estimate was made, ns."""
        return self._estimate_stamp

    @property
    def refusal(self) -> str | None:
        """Why the latest identification was refused; None if it was not."""
        return self._refusal

    def change_settings(self, settings: MonitorSettings) -> None:
        """Put new settings in force; a new window or sensor range empties the buffer."""
        if (settings.valve, settings.window) != (self._settings.valve, self._settings.window):
            self.buffer = RecordBuffer(settings.valve, settings.window)
            self.buffer.clear("valve or window parameters were changed")
        if settings.baseline != self._settings.baseline:
            self._baseline = settings.baseline
        self._settings = settings

    def accept(self, estimate: Estimate, stamp: int) -> None:
        """Remember an estimate made at `stamp` (ns)."""
        self._estimate, self._estimate_stamp, self._refusal = estimate, stamp, None

    def refuse(self, refusal: RefusalError) -> None:
        """Remember that an identification was refused."""
        self._refusal = str(refusal)

    def set_baseline(self) -> float:
        """Make the latest estimate the baseline and return it, N.

        Raises
        ------
        RefusalError
            If there is no estimate, or its Coulomb friction is not above zero.
        """
        if self._estimate is None:
            raise RefusalError("there is no estimate to take as baseline: identify first")
        if self._estimate.coulomb_friction <= 0:
            raise RefusalError(
                f"a coulomb friction of {self._estimate.coulomb_friction:.4g} N is no baseline"
            )
        self._baseline = self._estimate.coulomb_friction
        return self._baseline

    def diagnosis(self) -> Diagnosis:
        """Judge the latest estimate; OK while there is none."""
        if self._estimate is None:
            reason = self._refusal or "nothing has been identified yet"
            return Diagnosis(Level.OK, StatusSignal.GOOD, f"no estimate: {reason}", None)
        return diagnose(self._estimate, self._settings.valve, self._baseline, self._settings.limits)
