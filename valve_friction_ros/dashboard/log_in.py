# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The log-in: a name and a password against the accounts, at a bounded rate; and sessions.

Who has logged in is known by a random token in a cookie.
"""

import asyncio
import contextlib
import hashlib
import ipaddress
import json
import math
import os
import secrets
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from valve_friction_ros.dashboard.accounts import Access, Account, HashedPassword, require_private

_MOST_KEYS = 10_000


class AttemptLimit:
    """Counts the attempts of each key, such as an address, within a sliding time.

    The keys that have tried least recently are forgotten above 10,000.

    Parameters
    ----------
    most : int
        Attempts within `period`.
    period : float
        s.
    clock : callable
        Returns the time, s.
    """

    def __init__(self, most: int, period: float, clock: Callable[[], float]) -> None:
        self._most, self._period, self._clock = most, period, clock
        self._times: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, key: str) -> int:
        """Return the time until the key may try again, s; 0 if now."""
        times = self._times.get(key, deque())
        if len(times) < self._most:
            return 0
        return max(0, math.ceil(times[0] + self._period - self._clock()))

    def count(self, key: str) -> None:
        """Count an attempt."""
        times = self._times.setdefault(key, deque(maxlen=self._most))
        times.append(self._clock())
        self._times.move_to_end(key)
        if len(self._times) > _MOST_KEYS:
            self._times.popitem(last=False)

    def forgive(self, key: str) -> None:
        """Uncount the latest attempt, which was right."""
        times = self._times.get(key)
        if times:
            times.pop()


_MOST_SESSIONS = 1000


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()


@dataclass(frozen=True)
class _Session:
    account: str
    """The digest of the account's line: a changed password or role ends its sessions."""
    end: float


class Sessions:
    """The sessions of a dashboard; of each token only a digest is kept.

    Parameters
    ----------
    accounts : sequence of Account
        Who may have one.
    lifetime : float
        Time from log-in to the end, s.
    clock : callable
        Returns the time, s since 1970.
    file : Path or None
        Where sessions survive a restart. It is made with mode 600.
    log : callable
        Takes a line when the file can no longer be written.

    Raises
    ------
    ValueError
        If others can read the file.
    OSError
        If the file cannot be read or written.
    """

    def __init__(
        self,
        accounts: Sequence[Account],
        lifetime: float,
        clock: Callable[[], float],
        file: Path | None = None,
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._accounts = {_digest(str(one)): one for one in accounts}
        self._lifetime, self._clock, self._file = lifetime, clock, file
        self._log = log
        self._sessions: dict[str, _Session] = {}
        if file is not None:
            self._read(file)
            self._keep()

    def begin(self, account: Account) -> str:
        """Begin a session; return its token. Above 1000 sessions the oldest ends."""
        token = secrets.token_urlsafe(32)
        now = self._clock()
        live = [item for item in self._sessions.items() if item[1].end > now][1 - _MOST_SESSIONS :]
        session = _Session(_digest(str(account)), now + self._lifetime)
        self._sessions = {**dict(live), _digest(token): session}
        self._keep_if_possible()
        return token

    def account_of(self, token: str | None) -> Account | None:
        """Return whose session a token is of; None where there is none, or it has ended."""
        session = self._sessions.get(_digest(token)) if token else None
        if session is None or session.end <= self._clock():
            return None
        return self._accounts.get(session.account)

    def end(self, token: str | None) -> None:
        """End a session, if it is one."""
        if token and self._sessions.pop(_digest(token), None) is not None:
            self._keep_if_possible()

    def _read(self, file: Path) -> None:
        """Take over the sessions of the file; what is no session is left out."""
        with contextlib.suppress(FileNotFoundError):
            require_private(file)
            with contextlib.suppress(ValueError, TypeError, AttributeError):
                kept = json.loads(file.read_bytes())
                self._sessions = {
                    key: _Session(str(account), float(end)) for key, (account, end) in kept.items()
                }

    def _keep_if_possible(self) -> None:
        """Keep the sessions; go on in memory where the file cannot be written."""
        try:
            self._keep()
        except OSError as error:
            self._log(
                f"the sessions cannot be kept in {self._file} ({error.strerror or error}): they go "
                "on until the dashboard ends; free space, or name another session_file"
            )

    def _keep(self) -> None:
        if self._file is None:
            return
        kept = {key: [one.account, one.end] for key, one in self._sessions.items()}
        draft = self._file.with_name(f".{os.getpid()}_{self._file.name}")
        draft.unlink(missing_ok=True)
        draft.touch(mode=0o600, exist_ok=False)
        draft.write_text(json.dumps(kept))
        draft.replace(self._file)


_ATTEMPT_PERIOD = 900.0
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
        self._addresses = AttemptLimit(_MOST_OF_ADDRESS, _ATTEMPT_PERIOD, clock)
        self._names = AttemptLimit(_MOST_OF_NAME, _ATTEMPT_PERIOD, clock)
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
