# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Waiting for what another process or thread does."""

import time

PATIENCE = 120.0
"""Time for one thing to happen on a slow and loaded machine, s."""


def wait_until(condition, told=lambda: "", patience=PATIENCE, turn=0.01):
    """Look until `condition()` is true, and return it; fail with what is `told` at the end."""
    deadline = time.monotonic() + patience
    while not (met := condition()):
        assert time.monotonic() < deadline, f"not within {patience:g} s: {told()}"
        time.sleep(turn)
    return met
