# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Changes that wait for the history: which are given up, and how the thread that writes waits."""

import time
from functools import partial
from pathlib import Path

import pytest

from valve_friction_ros.history import HistoryError
from valve_friction_ros.nodes.identifier import workers
from valve_friction_ros.nodes.identifier.history_writer import WaitingChanges
from valve_friction_ros.nodes.identifier.workers import HistoryThread


def change(name):
    return partial(print, name)


def drained(waiting):
    names = []
    while (one := waiting.first()) is not None:
        names.append(one.args[0])
        waiting.remove(one)
    return names


def test_identifications_go_first_and_the_order_stays():
    waiting = WaitingChanges(most=4)
    waiting.add(change("baseline"))
    for k in range(5):
        waiting.add(change(f"identified {k}"), identification=True)
    waiting.add(change("renewal"))
    assert waiting.given_up == "3 identifications"
    assert drained(waiting) == ["baseline", "identified 3", "identified 4", "renewal"]


def test_without_identifications_the_oldest_goes():
    waiting = WaitingChanges(most=2)
    for k in range(3):
        waiting.add(change(k))
    assert waiting.given_up == "1 other change"
    waiting.add(change("identified"), identification=True)
    assert waiting.given_up == "1 identification and 1 other change"
    waiting.forget_given_up()
    assert waiting.given_up == ""
    assert drained(waiting) == [1, 2]


def test_a_change_waits_once_and_may_go_while_it_is_made():
    waiting, one = WaitingChanges(most=1), change("made")
    waiting.add(one)
    waiting.add(one)
    assert waiting.given_up == ""
    waiting.add(change("next"))
    waiting.remove(one)
    assert drained(waiting) == ["next"]


class TestHistoryThread:
    """One for all valves of a process."""

    PLACE = Path("history.sqlite")

    def fail(self, thread, asked, place=PLACE, lasts=0.0):
        """Return whether a writing that fails was tried."""
        tried = []

        def locked():
            tried.append(time.sleep(lasts))
            raise HistoryError("locked")

        with pytest.raises(HistoryError, match="locked"), thread.writing(place, asked):
            locked()
        return bool(tried)

    def test_a_locked_file_is_waited_for_once(self, monkeypatch):
        monkeypatch.setattr(workers, "_LONG", 0.01)
        thread, asked = HistoryThread(), time.monotonic()
        assert self.fail(thread, asked, lasts=0.02)
        assert not self.fail(thread, asked)
        assert self.fail(thread, asked, place=Path("another.sqlite"))
        with thread.writing(self.PLACE, time.monotonic()):
            pass  # what is asked for later is tried
        assert self.fail(thread, time.monotonic())

    def test_what_fails_at_once_holds_up_nothing(self):
        thread, asked = HistoryThread(), time.monotonic()
        assert self.fail(thread, asked)
        with thread.writing(self.PLACE, asked):
            pass
