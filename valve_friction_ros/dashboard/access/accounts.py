"""Accounts of a dashboard: name, role and hash of a password, from a file or the environment."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from valve_friction_ros.dashboard.access.passwords import HashedPassword
from valve_friction_ros.dashboard.access.private_file import require_private

__all__ = ["VARIABLE", "Account", "Role", "accounts_from"]

VARIABLE = "VALVE_FRICTION_DASHBOARD_ACCOUNTS"
"""Variable of the environment with accounts, where there is no file."""

_NAME = re.compile(r"[\w.@+-]{1,64}")


class Role(Enum):
    """What an account may do: look only, or call the services of identifiers too."""

    VIEW = "view"
    OPERATE = "operate"


@dataclass(frozen=True)
class Account:
    """One who may log in.

    As text it is ``NAME ROLE HASH``, a line of the file of accounts.

    Attributes
    ----------
    name : str
        Letters, digits and ``_.@+-``, 64 at most.
    role : Role
        What they may do.
    password : HashedPassword
        The hash of their password.

    Raises
    ------
    ValueError
        If the name is none.
    """

    name: str
    role: Role
    password: HashedPassword

    def __post_init__(self) -> None:
        """Refuse a name that is none."""
        if not _NAME.fullmatch(self.name):
            raise ValueError("the name of an account has 1 to 64 letters, digits or _.@+-")

    @classmethod
    def read(cls, line: str) -> "Account":
        """Read a line; raises ValueError, without what the line holds, if it is no account."""
        words = line.split()
        if len(words) != 3 or words[1] not in {role.value for role in Role}:
            raise ValueError("not NAME, role (view or operate) and hash")
        return cls(words[0], Role(words[1]), HashedPassword.read(words[2]))

    def __str__(self) -> str:
        """Return the line that `read` reads."""
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
            raise ValueError(f"{source}, line {number}: {account.name!r} is there twice")
        found[account.name] = account
    if not found:
        raise ValueError(
            f"{source} holds no account: add one by `valve_friction dashboard-account`"
        )
    return tuple(found.values())


def accounts_from(
    file: Path | None, environment: Mapping[str, str] = os.environ
) -> tuple[Account, ...]:
    """Return the accounts of a file or else of the environment; none where neither is given.

    The environment's are in `VARIABLE`, separated by semicolons or new lines.

    Raises
    ------
    ValueError
        If a line is no account, a name is there twice, others can read the file, or both the file
        and the variable are given.
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
