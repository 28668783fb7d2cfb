# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A valve's history belongs to one node at a time, and to none that has been killed."""

import subprocess
import sys

from valve_friction_ros.history.place import Claim

HOLD = """
import sys
from pathlib import Path
from valve_friction_ros.history.place import Claim
claim = Claim(Path(sys.argv[1]), "/fv_101/identifier")
print(claim.ask(), flush=True)
sys.stdin.read()
"""


def test_one_claim_a_valve(tmp_path):
    path = tmp_path / "history.sqlite"
    one, other, same = (Claim(path, name) for name in ("/fv_101", "/fv_102", "/fv_101"))
    assert one.ask()
    assert one.ask()
    assert other.ask()
    assert not same.ask()
    assert Claim(tmp_path / "other.sqlite", "/fv_101").ask()
    one.release()
    assert same.ask()
    for claim in (other, same):
        claim.release()


def test_a_killed_process_has_none(tmp_path):
    path = tmp_path / "history.sqlite"
    claim = Claim(path, "/fv_101/identifier")
    command = [sys.executable, "-c", HOLD, str(path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout.readline() == "True\n"
        assert not claim.ask()
        holder.kill()
    assert claim.ask()
    claim.release()


def test_a_folder_that_is_not_there_grants_it(tmp_path):
    claim = Claim(tmp_path / "nowhere" / "history.sqlite", "/fv_101")
    assert claim.ask()
    claim.release()
