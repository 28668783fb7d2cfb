# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Location of a history, a file or a server, and claims on it; needs no database."""

import fcntl
import hashlib
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from urllib.parse import parse_qsl, unquote, urlsplit

URL_VARIABLE = "VALVE_FRICTION_HISTORY_URL"
"""Environment variable with the address of the server, which may include a password."""

_SCHEMES = ("postgresql", "postgres")
_HIDDEN = "***"


def is_url(text: str) -> bool:
    """Return whether a text is the address of a server rather than a path."""
    return text.partition("://")[0].lower() in _SCHEMES and "://" in text


@dataclass(frozen=True)
class HistoryServer:
    """A history in PostgreSQL.

    Its text shows user, host and database, and nothing that may be secret.

    Attributes
    ----------
    url : str
        Address as PostgreSQL clients read it: ``postgresql://user@host/database``, with parameters
        such as ``?sslmode=verify-full``.
    """

    url: str = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse an invalid address without repeating it."""
        if not is_url(self.url) or not self.url.isprintable() or " " in self.url:
            raise ValueError(
                "not the address of a server: write it as postgresql://user@host/database"
            )
        try:
            urlsplit(self.url)
        except ValueError:
            raise ValueError(
                "the address of the server cannot be read: encode special characters of the "
                "password, or put it into ~/.pgpass"
            ) from None

    def __str__(self) -> str:
        """Return the address without password and parameters."""
        parts = urlsplit(self.url)
        user, at, hosts = parts.netloc.rpartition("@")
        name = user.partition(":")[0]
        return f"postgresql://{name}{at}{hosts}{parts.path}"

    @property
    def secrets(self) -> tuple[str, ...]:
        """Passwords in the address, encoded and decoded."""
        parts = urlsplit(self.url)
        written = [parts.netloc.rpartition("@")[0].partition(":")[2]]
        pairs = [one.partition("=") for one in parts.query.split("&")]
        written += [value for name, _, value in pairs if "password" in name.lower()]
        meant = [value for name, value in parse_qsl(parts.query) if "password" in name.lower()]
        found = {*written, *map(unquote, written), *meant}
        return tuple(sorted(filter(None, found), key=len, reverse=True))

    def without_secrets(self, text: str) -> str:
        """Return a text in one line, without the passwords of this address."""
        for secret in (self.url, *self.secrets):
            text = text.replace(secret, _HIDDEN)
        return " ".join(text.split())


def server_from(
    url: str, name: str = "history_url", environment: Mapping[str, str] = os.environ
) -> HistoryServer | None:
    """Return the server of the parameter `name`, else of the environment, or None.

    Raises ValueError, without the address, if it is invalid or if the parameter holds a password.
    """
    url = url.strip()
    place = name if url else URL_VARIABLE
    url = url or environment.get(URL_VARIABLE, "").strip()
    if not url:
        return None
    try:
        server = HistoryServer(url)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None
    if place == name and server.secrets:
        raise ValueError(
            f"{name} holds a password, which everybody on the ROS graph can read: put it into "
            f"~/.pgpass or PGPASSWORD, or the whole address into {URL_VARIABLE}"
        )
    return server


Place = Path | HistoryServer
"""Location of a history."""


class HistoryError(Exception):
    """The history cannot be read or written; the message names it, the cause and a remedy."""


class RowRefusedError(HistoryError):
    """A server refuses a row for its content, and would do so each time."""


class FileStamp(NamedTuple):
    """Time of the last change (ns), size and inode number of a file; zeros if it is missing."""

    time: int = 0
    size: int = 0
    number: int = 0


def _stamp_of(path: Path) -> FileStamp:
    try:
        status = path.stat()
    except OSError:
        return FileStamp()
    return FileStamp(status.st_mtime_ns, status.st_size, status.st_ino)


def file_state(path: Path) -> tuple[FileStamp, FileStamp]:
    """Return the stamps of a history and its journal; a change of the history changes either."""
    return _stamp_of(path), _stamp_of(path.with_name(f"{path.name}-wal"))


_CLAIMS_ENDING = "-nodes"
"""Suffix of the claims file after the name of the history; the file has no content."""

BESIDE_ENDINGS = ("-wal", "-shm", _CLAIMS_ENDING)
"""Suffixes of the files that an open database may have beside it, and a killed process leaves."""

_CLAIM_PLACES = 2**62


class Claim:
    """A claim on the history of one valve, which ends with its process, however that ends.

    It is a lock on one byte of a file next to the history, at a position computed from the name of
    the valve. If the file cannot be created or locked, every claim is granted.

    Parameters
    ----------
    history : Path
        The history.
    valve : str
        Name of the valve.
    """

    def __init__(self, history: Path, valve: str) -> None:
        self._path = history.with_name(history.name + _CLAIMS_ENDING)
        digest = hashlib.sha256(valve.encode()).digest()
        self._place = int.from_bytes(digest[:8], "big") % _CLAIM_PLACES
        self._file: int | None = None
        self.is_granted = False

    def ask(self) -> bool:
        """Ask for the claim unless it is already granted; return whether it is."""
        if not self.is_granted:
            self.is_granted = self._locked()
        return self.is_granted

    def _locked(self) -> bool:
        try:
            if self._file is None:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            lock = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, self._place, 1, 0)
            fcntl.fcntl(self._file, fcntl.F_OFD_SETLK, lock)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True

    def release(self) -> None:
        """Release the claim."""
        self.is_granted = False
        if self._file is not None:
            os.close(self._file)
            self._file = None
