"""Accounts whose passwords are hashed in a millisecond."""

import secrets

from valve_friction_ros.dashboard.access import Account, HashedPassword, Role

PASSWORD = "correct horse battery"


def quick_hash(password=PASSWORD):
    empty = HashedPassword(10, 1, 1, secrets.token_bytes(16), bytes(32))
    return HashedPassword(10, 1, 1, empty.salt, empty._hashed(password))


def quick_account(name="anna", role=Role.OPERATE, password=PASSWORD):
    return Account(name, role, quick_hash(password))
