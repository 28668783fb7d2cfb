# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Address and access control of a dashboard: accounts from a file or the environment.

Only a hash of each password is stored. scrypt (RFC 7914) is in Python's standard library and needs
memory as well as time, which makes attacks on a stolen file with graphics cards slow. Its cost is
one of the equivalent settings of OWASP's *Password Storage Cheat Sheet*: N = 2¹⁴, r = 8, p = 5,
which takes 16 MiB and some 0.2 s per try.
"""

import base64
import binascii
import hashlib
import hmac
import os
import re
import secrets
import ssl
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from valve_friction_ros.outside_text import is_loopback


def require_private(file: Path) -> None:
    """Raise ValueError if anybody but the owner can read or write a file."""
    if file.stat().st_mode & 0o077:
        raise ValueError(f"{file} is open to others: run `chmod 600 {file}`")


SHORTEST, LONGEST = 10, 200
"""Minimum and maximum number of characters in a password."""

_KIND = "scrypt"
_COST, _BLOCK, _PARALLEL = 14, 8, 5
_SALT, _DIGEST = 16, 32
_MOST_COST, _MOST_BLOCK, _MOST_PARALLEL = 20, 16, 16


def _encoded(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


def _decoded(text: str) -> bytes:
    return base64.b64decode(text + "=" * (-len(text) % 4), altchars=b"-_", validate=True)


@dataclass(frozen=True)
class HashedPassword:
    """A salted hash of a password.

    Its text form is ``scrypt:14:8:5:SALT:DIGEST``: log₂ N, r, p, and salt and digest in base64. No
    character in it is special to a shell.

    Raises
    ------
    ValueError
        If the cost is outside the limits for a log-in, or salt or digest is too short.
    """

    cost: int
    block: int
    parallel: int
    """log₂ N, r and p of scrypt."""
    salt: bytes = field(repr=False)
    digest: bytes = field(repr=False)
    """The salt hashed with the password, and the result."""

    def __post_init__(self) -> None:
        """Refuse an invalid hash, or one that would exhaust the machine's memory."""
        if not (
            10 <= self.cost <= _MOST_COST
            and 1 <= self.block <= _MOST_BLOCK
            and 1 <= self.parallel <= _MOST_PARALLEL
            and len(self.salt) >= _SALT
            and len(self.digest) >= _DIGEST
        ):
            raise ValueError("not a usable password hash")

    @classmethod
    def of(cls, password: str) -> "HashedPassword":
        """Hash a new password with a fresh salt.

        Raises ValueError if it has fewer than `SHORTEST` or more than `LONGEST` characters.
        """
        if not SHORTEST <= len(password) <= LONGEST:
            raise ValueError(
                f"a password must have {SHORTEST} to {LONGEST} characters, but this one has "
                f"{len(password)}"
            )
        salt = secrets.token_bytes(_SALT)
        empty = cls(_COST, _BLOCK, _PARALLEL, salt, bytes(_DIGEST))
        return cls(_COST, _BLOCK, _PARALLEL, salt, empty._hashed(password))

    @classmethod
    def unknown(cls) -> "HashedPassword":
        """Return a hash that matches no password."""
        salt, digest = secrets.token_bytes(_SALT), secrets.token_bytes(_DIGEST)
        return cls(_COST, _BLOCK, _PARALLEL, salt, digest)

    @classmethod
    def read(cls, text: str) -> "HashedPassword":
        """Read the text of a hash; raises ValueError, without quoting the text, if invalid."""
        kind, *rest = text.split(":")
        try:
            if kind != _KIND:
                raise ValueError
            cost, block, parallel, salt, digest = rest
            return cls(int(cost), int(block), int(parallel), _decoded(salt), _decoded(digest))
        except (ValueError, binascii.Error):
            raise ValueError(
                "not a usable password hash: make one with `valve_friction dashboard-account`"
            ) from None

    def __str__(self) -> str:
        """Return the text form that `read` accepts."""
        numbers = f"{self.cost}:{self.block}:{self.parallel}"
        return f"{_KIND}:{numbers}:{_encoded(self.salt)}:{_encoded(self.digest)}"

    def matches(self, password: str) -> bool:
        """Return whether a password matches, in a time that reveals nothing about the digest."""
        return hmac.compare_digest(self._hashed(password[:LONGEST]), self.digest)

    def _hashed(self, password: str) -> bytes:
        # Keyboards encode accented letters differently; NFKC makes the forms equal.
        return hashlib.scrypt(
            unicodedata.normalize("NFKC", password).encode(errors="surrogatepass"),
            salt=self.salt,
            n=1 << self.cost,
            r=self.block,
            p=self.parallel,
            maxmem=256 * self.block * (self.parallel + (1 << self.cost)),
            dklen=len(self.digest),
        )


VARIABLE = "VALVE_FRICTION_DASHBOARD_ACCOUNTS"
"""Environment variable with the accounts, if there is no file."""

_NAME = re.compile(r"[\w.@+-]{1,64}")


class Role(Enum):
    """Permission of an account: view only, or also call the services of identifiers."""

    VIEW = "view"
    OPERATE = "operate"


@dataclass(frozen=True)
class Account:
    """An account of the dashboard.

    Its text form is ``NAME ROLE HASH``, a line of the accounts file.

    Raises
    ------
    ValueError
        If the name is invalid.
    """

    name: str
    """Letters, digits and ``_.@+-``, 64 at most."""
    role: Role
    password: HashedPassword

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError("an account name must have 1 to 64 letters, digits or _.@+-")

    @classmethod
    def read(cls, line: str) -> "Account":
        """Read a line; raises ValueError, without quoting the line, if it is not an account."""
        words = line.split()
        if len(words) != 3 or words[1] not in {role.value for role in Role}:
            raise ValueError("not NAME, role (view or operate) and hash")
        return cls(words[0], Role(words[1]), HashedPassword.read(words[2]))

    def __str__(self) -> str:
        """Return the line that `read` accepts."""
        return f"{self.name} {self.role.value} {self.password}"


def _read(text: str, source: str) -> tuple[Account, ...]:
    found: dict[str, Account] = {}
    for number, line in enumerate(re.split(r"[\n;]", text), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            account = Account.read(line)
        except ValueError as error:
            raise ValueError(f"{source}, line {number}: {error}") from None
        if account.name in found:
            raise ValueError(f"{source}, line {number}: {account.name!r} is given twice")
        found[account.name] = account
    if not found:
        raise ValueError(
            f"{source} contains no account: add one with `valve_friction dashboard-account`"
        )
    return tuple(found.values())


def accounts_from(
    file: Path | None, environment: Mapping[str, str] = os.environ
) -> tuple[Account, ...]:
    """Return the accounts from a file or else the environment; empty if neither is given.

    The environment variable `VARIABLE` separates accounts by semicolons or new lines.

    Raises
    ------
    ValueError
        If a line is not an account, a name occurs twice, others can read the file, or both file and
        variable are given.
    OSError
        If the file cannot be read.
    """
    words = environment.get(VARIABLE, "")
    if file is None:
        return _read(words, VARIABLE) if words.strip() else ()
    if words.strip():
        raise ValueError(f"accounts are in {file} and in {VARIABLE}: give one of them")
    require_private(file)
    return _read(file.read_text(encoding="utf-8"), str(file))


@dataclass(frozen=True)
class Access:
    """Address, names, accounts and certificate of a dashboard.

    Raises
    ------
    ValueError
        If others can reach the dashboard and it has no accounts; if certificate or key is missing,
        if they do not match, or if others can read the key; if the duration is not positive.
    OSError
        If certificate or key cannot be read.
    """

    host: str = "127.0.0.1"
    """Address to listen on; ``0.0.0.0`` means all IPv4 addresses."""
    host_names: tuple[str, ...] = ()
    """Host names for browsers, besides the addresses and ``localhost``. Other names are refused,
    since the name of a foreign page can resolve to this host."""
    accounts: tuple[Account, ...] = ()
    """Accounts that may log in. Without accounts, anybody who reaches the address may operate."""
    certificate: Path | None = None
    key: Path | None = None
    """Files for TLS, in PEM."""
    session_hours: float = 12.0
    session_file: Path | None = None
    """File that keeps sessions across a restart; without it a restart ends them."""

    def __post_init__(self) -> None:
        """Refuse options that would let anybody in."""
        if not self.accounts and (not is_loopback(self.host) or self.host_names):
            raise ValueError(
                f"host {self.host!r} is open to other machines, but there are no accounts: create "
                "one with `valve_friction dashboard-account NAME >> FILE; chmod 600 FILE` and set "
                f"accounts_file (or put its lines into {VARIABLE}), or use 127.0.0.1"
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
        """Whether connections use TLS."""
        return self.certificate is not None

    @property
    def warning(self) -> str:
        """Warning for the operator; empty if there is none."""
        if self.accounts and not self.is_encrypted and not is_loopback(self.host):
            return (
                "no certificate: passwords and sessions can be read in transit; give "
                "certificate_file and key_file"
            )
        return ""

    def answers_to(self, called: str, address: str) -> bool:
        """Return whether `called`, the host in the header ``Host``, is the dashboard's own.

        A foreign page whose name resolves to this host sends its own name in that header (DNS
        rebinding). The local address of the connection needs no name and is always accepted.
        """
        name = called.lower().rstrip(".")
        known = {"localhost", self.host.lower(), *(each.lower() for each in self.host_names)}
        return name in known or name == address


def _require_pair(certificate: Path, key: Path) -> None:
    for file in (certificate, key):
        with file.open("rb"):
            pass
    try:
        # With a password given, OpenSSL refuses an encrypted key and does not prompt for one.
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except (ssl.SSLError, ValueError) as error:
        reason = getattr(error, "reason", None) or error
        raise ValueError(
            f"certificate {certificate} and key {key} cannot be used ({reason}): give a PEM "
            "certificate and its key without a password"
        ) from None
