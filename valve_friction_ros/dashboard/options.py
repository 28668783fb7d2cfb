"""How the dashboard is started."""

from dataclasses import dataclass, field
from pathlib import Path
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from valve_friction_ros.dashboard.access import Access
from valve_friction_ros.history import Place

__all__ = ["INSTALL", "DashboardOptions", "zone_of"]

INSTALL = "pip install 'nicegui>=3.18,<4'"
"""What installs the library of the pages, which rosdep does not know."""


def zone_of(name: str) -> ZoneInfo:
    """Return a time zone by its IANA name; raises ValueError for an unknown one."""
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise ValueError(
            f"time_zone {name!r} is unknown: give an IANA name such as UTC or Europe/Berlin"
        ) from None


@dataclass(frozen=True)
class DashboardOptions:
    """Address, files and times of a dashboard.

    Attributes
    ----------
    access : Access
        Address that it listens at, and whom it lets in.
    port : int
        Port that it listens at.
    history : Path or HistoryServer or None
        The history of the valves; None: there is none.
    reports, bags, alarms : Path or None
        The folders that it serves files from; None: there are none.
    time_zone : str
        Zone of the times, where the address names no other.
    silence : float
        Time without a message after which a valve is silent, s.

    Raises
    ------
    ValueError
        If the port or the silence is impossible, or the zone unknown.
    """

    access: Access = field(default_factory=Access)
    port: int = 8080
    history: Place | None = None
    reports: Path | None = None
    bags: Path | None = None
    alarms: Path | None = None
    time_zone: str = "UTC"
    silence: float = 5.0

    def __post_init__(self) -> None:
        """Refuse impossible options."""
        if not 0 < self.port < 65536:
            raise ValueError(f"port {self.port} is impossible: give one from 1 to 65535")
        if not self.silence > 0:
            raise ValueError(f"silence must be above 0 s, got {self.silence:g}")
        zone_of(self.time_zone)

    @property
    def address(self) -> str:
        """The address to open in a browser of this machine."""
        host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self.access.host, self.access.host)  # noqa: S104
        scheme = "https" if self.access.is_encrypted else "http"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{self.port}/"
