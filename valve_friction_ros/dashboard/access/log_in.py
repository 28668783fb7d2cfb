"""The log-in: a name and a password against the accounts, at a bounded rate."""

import asyncio
import ipaddress
import time
from collections.abc import Callable
from dataclasses import dataclass

from valve_friction_ros.dashboard.access.access import Access
from valve_friction_ros.dashboard.access.attempt_limit import AttemptLimit
from valve_friction_ros.dashboard.access.passwords import HashedPassword
from valve_friction_ros.dashboard.access.sessions import Sessions

__all__ = ["LogIn", "Refusal", "network_of"]

_PERIOD = 900.0
_MOST_OF_ADDRESS, _MOST_OF_NAME = 10, 20
_MOST_WAITING = 8


@dataclass(frozen=True)
class Refusal:
    """Why nobody was let in.

    Attributes
    ----------
    wait : int
        Time until the next try is looked at, s; 0 where name or password was wrong.
    """

    wait: int


def network_of(address: str) -> str:
    """Return what one household has of addresses: an IPv4 address, or 64 bits of IPv6."""
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return address
    if known.version == 4:
        return address
    mapped = known.ipv4_mapped
    return str(mapped or ipaddress.ip_network((known, 64), strict=False))


class LogIn:
    """Lets in who knows a password.

    An address has 10 wrong tries in 15 minutes, a name 20 from everywhere. An unknown name takes
    as long as a known one, is counted as one, and has the same answer. Passwords are compared one
    at a time in a thread, so that tries cannot take the machine from its work.

    Parameters
    ----------
    access : Access
        The accounts.
    sessions : Sessions
        Where a session begins.
    clock : callable
        Returns the time, s.
    """

    def __init__(
        self, access: Access, sessions: Sessions, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._accounts = {account.name: account for account in access.accounts}
        self._sessions = sessions
        self._addresses = AttemptLimit(_MOST_OF_ADDRESS, _PERIOD, clock)
        self._names = AttemptLimit(_MOST_OF_NAME, _PERIOD, clock)
        self._unknown = HashedPassword.unknown(
            like=access.accounts[0].password if access.accounts else None
        )
        self._comparing = asyncio.Semaphore(1)
        self._waiting = 0

    async def attempt(self, name: str, password: str, address: str) -> str | Refusal:
        """Return the token of a new session, or why there is none.

        An attempt counts before it is compared: many at once get no further than one by one.
        """
        network, name = network_of(address), name[:64]
        wait = max(self._addresses.wait(network), self._names.wait(name))
        if wait == 0 and self._waiting >= _MOST_WAITING:
            wait = 1
        if wait > 0:
            return Refusal(wait)
        self._addresses.count(network)
        self._names.count(name)
        account = self._accounts.get(name)
        known = self._unknown if account is None else account.password
        self._waiting += 1
        try:
            async with self._comparing:
                is_right = await asyncio.to_thread(known.matches, password)
        finally:
            self._waiting -= 1
        if account is None or not is_right:
            return Refusal(0)
        self._addresses.forgive(network)
        self._names.forgive(name)
        return self._sessions.begin(account)
