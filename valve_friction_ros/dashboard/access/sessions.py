"""Sessions: who has logged in, known by a random token in a cookie."""

import contextlib
import hashlib
import json
import os
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from valve_friction_ros.dashboard.access.accounts import Account
from valve_friction_ros.dashboard.access.private_file import require_private

__all__ = ["Sessions"]

_MOST = 1000


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
        live = [item for item in self._sessions.items() if item[1].end > now][1 - _MOST :]
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
