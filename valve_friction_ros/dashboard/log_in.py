# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Log-in by name and password at a limited rate, and sessions.

A random token in a cookie identifies the session.
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
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.dashboard.accounts import Access, Account, require_private

_MOST_KEYS = 10_000


class AttemptLimit:
    """Limits the attempts per key, such as an address, to `most` within a sliding period, s.

    Above 10,000 keys, those with the oldest attempts are forgotten.
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
        """Remove the latest attempt from the count, because it succeeded."""
        times = self._times.get(key)
        if times:
            times.pop()


_MOST_LINES = 60
"""Maximum number of lines per minute on what others may do without end."""


def limited(log: Callable[[str], None]) -> Callable[[str], None]:
    """Return a log that passes on at most 60 lines per minute, and drops the others."""
    lines = AttemptLimit(_MOST_LINES, 60.0, time.monotonic)

    def tell(line: str) -> None:
        if lines.wait("") <= 0:
            lines.count("")
            log(line)

    return tell


_MOST_SESSIONS = 1000


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()


class _Session(NamedTuple):
    account: str
    """Digest of the account's line, so that a changed password or role ends its sessions."""
    end: float


class Sessions:
    """The sessions of a dashboard; only a digest of each token is stored.

    A session lasts `lifetime`, s. A file, created with mode 600, keeps the sessions across a
    restart; `log` takes a line when it can no longer be written. Raises ValueError if others can
    read the file, and OSError if it cannot be read or written.
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
        """Begin a session and return its token. Above 1000 sessions the oldest ends."""
        token = secrets.token_urlsafe(32)
        now = self._clock()
        live = [item for item in self._sessions.items() if item[1].end > now][1 - _MOST_SESSIONS :]
        session = _Session(_digest(str(account)), now + self._lifetime)
        self._sessions = {**dict(live), _digest(token): session}
        self._keep_if_possible()
        return token

    def account_of(self, token: str | None) -> Account | None:
        """Return the account of a session token; None if there is no session or it has ended."""
        session = self._sessions.get(_digest(token)) if token else None
        if session is None or session.end <= self._clock():
            return None
        return self._accounts.get(session.account)

    def end(self, token: str | None) -> None:
        """End a session, if the token has one."""
        if token and self._sessions.pop(_digest(token), None) is not None:
            self._keep_if_possible()

    def _read(self, file: Path) -> None:
        """Load the sessions of the file; ignore invalid content."""
        with contextlib.suppress(FileNotFoundError):
            require_private(file)
            with contextlib.suppress(ValueError, TypeError, AttributeError):
                kept = json.loads(file.read_bytes())
                self._sessions = {
                    key: _Session(str(account), float(end)) for key, (account, end) in kept.items()
                }

    def _keep_if_possible(self) -> None:
        """Save the sessions; continue in memory if the file cannot be written."""
        try:
            self._keep()
        except OSError as error:
            self._log(
                f"the sessions cannot be kept in {self._file} ({error.strerror or error}): they "
                "last until the dashboard ends; free space, or name another session_file"
            )

    def _keep(self) -> None:
        if self._file is None:
            return
        draft = self._file.with_name(f".{os.getpid()}_{self._file.name}")
        draft.unlink(missing_ok=True)
        draft.touch(mode=0o600, exist_ok=False)
        draft.write_text(json.dumps(self._sessions))
        draft.replace(self._file)


_ATTEMPT_PERIOD = 900.0
_MOST_OF_ADDRESS, _MOST_OF_NAME = 10, 20
_MOST_WAITING = 8


def network_of(address: str) -> str:
    """Return the addresses of one household: an IPv4 address, or a /64 network of IPv6."""
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return address
    if known.version == 4:
        return address
    mapped = known.ipv4_mapped
    return str(mapped or ipaddress.ip_network((known, 64), strict=False))


class LogIn:
    """Logs in visitors by name and password.

    In 15 minutes an address has 10 wrong attempts, and a name 20 from all addresses. An unknown
    name is indistinguishable from a known one: time, counting and answer are the same. A thread
    compares one password at a time, so that attempts cannot overload the machine.
    """

    def __init__(
        self, access: Access, sessions: Sessions, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._accounts = {account.name: account for account in access.accounts}
        self._sessions = sessions
        self._addresses = AttemptLimit(_MOST_OF_ADDRESS, _ATTEMPT_PERIOD, clock)
        self._names = AttemptLimit(_MOST_OF_NAME, _ATTEMPT_PERIOD, clock)
        self._comparing = asyncio.Semaphore(1)
        self._waiting = 0

    async def attempt(self, name: str, password: str, address: str) -> str | int:
        """Return the token of a new session, or after a refusal, the time to wait.

        That is the time until another attempt is allowed, s; 0 if name or password was wrong. An
        attempt is counted before the comparison, so that simultaneous attempts gain nothing.
        """
        network, name = network_of(address), name[:64]
        wait = max(self._addresses.wait(network), self._names.wait(name))
        if wait == 0 and self._waiting >= _MOST_WAITING:
            wait = 1
        if wait > 0:
            return wait
        self._addresses.count(network)
        self._names.count(name)
        account = self._accounts.get(name)
        compared = account or next(iter(self._accounts.values()))  # takes as long, and is refused
        self._waiting += 1
        try:
            async with self._comparing:
                is_right = await asyncio.to_thread(compared.password.matches, password)
        finally:
            self._waiting -= 1
        if account is None or not is_right:
            return 0
        self._addresses.forgive(network)
        self._names.forgive(name)
        return self._sessions.begin(account)
