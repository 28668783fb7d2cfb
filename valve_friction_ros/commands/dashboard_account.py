"""Sub-command `dashboard-account`: a line of the file of accounts, with the hash of a password."""

import argparse
import getpass
import sys

from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.dashboard.access import Account, HashedPassword, Role

__all__ = ["REFUSALS", "run"]

REFUSALS = ()


def _password() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\r\n")
    password = getpass.getpass("Password: ")
    if getpass.getpass("Again: ") != password:
        raise ValueError("the two passwords differ")
    return password


def run(options: argparse.Namespace) -> int:
    """Ask, and print the line."""
    account = Account(options.name, Role(options.role), HashedPassword.unknown())
    print(Account(account.name, account.role, HashedPassword.of(_password())))
    return ExitCode.DONE
