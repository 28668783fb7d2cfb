"""Sub-command `dashboard-account`: a line of the file of accounts, with the hash of a password."""

import argparse
import getpass
import sys

from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.dashboard.access import Account, HashedPassword, Role

__all__ = ["REFUSALS", "declare", "run"]

REFUSALS = ()


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments, and what the help says around them."""
    parser.description = (
        "Print an account of the dashboard: its name, role and the hash of a password, which is "
        "asked for twice on a terminal, else read from the first line of the standard input."
    )
    parser.epilog = (
        "`valve_friction dashboard-account anna --role operate >> accounts; chmod 600 accounts` "
        "adds it to a file, which the dashboard reads when it starts. Exit code 2: the name or the "
        "password was refused."
    )
    parser.add_argument("name", metavar="NAME", help="letters, digits and _.@+-")
    parser.add_argument(
        "--role",
        choices=[role.value for role in Role],
        default=Role.VIEW.value,
        help="view: look only; operate: call services of identifiers too (%(default)s)",
    )


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
