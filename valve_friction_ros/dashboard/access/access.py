"""Where a dashboard listens, and whom it lets in."""

import ssl
from dataclasses import dataclass
from pathlib import Path

from valve_friction_ros.dashboard.access.accounts import VARIABLE, Account
from valve_friction_ros.dashboard.access.private_file import require_private
from valve_friction_ros.loopback import is_loopback

__all__ = ["Access"]


@dataclass(frozen=True)
class Access:
    """Address, names, accounts and certificate of a dashboard.

    Attributes
    ----------
    host : str
        Address that it listens at; ``0.0.0.0`` is all of IPv4's.
    host_names : tuple of str
        Names by which browsers call it, beside its addresses and ``localhost``. Other names are
        refused, since a foreign page can have a name that leads here.
    accounts : tuple of Account
        Who may log in. Without any, whoever reaches the address may operate.
    certificate, key : Path or None
        Files for TLS, in PEM.
    session_hours : float
        Time after which a log-in ends, h.
    session_file : Path or None
        Where sessions survive a restart; without it they do not.

    Raises
    ------
    ValueError
        If others can reach the dashboard and it has no accounts; if one of certificate and key is
        missing, or they do not belong together, or others can read the key; if the time is not
        positive.
    OSError
        If certificate or key cannot be read.
    """

    host: str = "127.0.0.1"
    host_names: tuple[str, ...] = ()
    accounts: tuple[Account, ...] = ()
    certificate: Path | None = None
    key: Path | None = None
    session_hours: float = 12.0
    session_file: Path | None = None

    def __post_init__(self) -> None:
        """Refuse what would let anybody in."""
        if not self.accounts and (not is_loopback(self.host) or self.host_names):
            raise ValueError(
                f"host {self.host!r} lets others in, and there are no accounts: make one by "
                "`valve_friction dashboard-account NAME >> FILE; chmod 600 FILE` and give the "
                f"parameter accounts_file (or its lines in {VARIABLE}), or use 127.0.0.1"
            )
        if not 0 < self.session_hours <= 10_000:
            raise ValueError(f"session_hours is {self.session_hours:g}: give 0 to 10000")
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate_file and key_file belong together: give both or none")
        if self.certificate is not None and self.key is not None:
            require_private(self.key)
            _require_pair(self.certificate, self.key)

    @property
    def is_encrypted(self) -> bool:
        """Whether it speaks TLS."""
        return self.certificate is not None

    @property
    def warning(self) -> str:
        """What its operator should know; empty if nothing."""
        if self.accounts and not self.is_encrypted and not is_loopback(self.host):
            return (
                "no certificate: passwords and sessions can be read on the way; give "
                "certificate_file and key_file"
            )
        return ""

    def answers_to(self, called: str, address: str) -> bool:
        """Tell whether it is called by a name of its own.

        Parameters
        ----------
        called : str
            What the browser calls it, the header ``Host`` without the port.
        address : str
            The address that the connection came in at.

        A page whose name leads here has its own name in that header (DNS rebinding). An address
        is no name, so the one that was connected to is always right.
        """
        name = called.lower().rstrip(".")
        known = {"localhost", self.host.lower(), *(each.lower() for each in self.host_names)}
        return name in known or name == address


def _require_pair(certificate: Path, key: Path) -> None:
    for file in (certificate, key):
        with file.open("rb"):
            pass
    try:
        # A password is given so that an encrypted key is refused, not asked for on the terminal.
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except (ssl.SSLError, ValueError) as error:
        reason = getattr(error, "reason", None) or error
        raise ValueError(
            f"certificate {certificate} and key {key} cannot be used ({reason}): give a PEM "
            "certificate and its key without a password"
        ) from None
