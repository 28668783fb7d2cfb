# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Accounts whose passwords are hashed in a millisecond."""

import secrets

from valve_friction_ros.dashboard.accounts import Account, HashedPassword, Role

PASSWORD = "correct horse battery"


def quick_hash(password=PASSWORD):
    empty = HashedPassword(10, 1, 1, secrets.token_bytes(16), bytes(32))
    return HashedPassword(10, 1, 1, empty.salt, empty._hashed(password))


def quick_account(name="anna", role=Role.OPERATE, password=PASSWORD):
    return Account(name, role, quick_hash(password))
