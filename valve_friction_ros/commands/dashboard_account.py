# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `dashboard-account`: make a line of the accounts file, with a hashed password."""

import argparse
import getpass
import sys

from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.dashboard.accounts import Account, HashedPassword, Role


def _password() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\r\n")
    password = getpass.getpass("Password: ")
    if getpass.getpass("Again: ") != password:
        raise ValueError("the two passwords differ")
    return password


def run(options: argparse.Namespace) -> int:
    """Ask for the password and print the line."""
    account = Account(options.name, Role(options.role), HashedPassword.unknown())
    print(Account(account.name, account.role, HashedPassword.of(_password())))
    return ExitCode.DONE
