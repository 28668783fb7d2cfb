# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Copies of a history, and what a file sends to a server: all of it, once, whatever ends."""

import math
import signal
import threading
import time
from pathlib import Path

import pytest
from full_history import BUILT, all_of, answer, fill, filled, service_move
from histories import (
    DAY,
    OTHER,
    START,
    VALVE,
    change,
    make_version,
    make_version_5,
    refused,
    success,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from local_server import database_of, sending
from processes import printed, wait_until
from writers import writer

from valve_friction_ros.health import Baseline, Level, Measured
from valve_friction_ros.history import (
    History,
    HistoryError,
    HistoryFile,
    HistoryServer,
    KeptBaseline,
    copied,
    copying,
    forget_moves_after,
    keep_answers,
    keep_moves,
    keep_renewal,
    keep_told_level,
    read_answers,
    read_moves,
    read_told_level,
    sender_of,
)
from valve_friction_ros.history.outbox import count_unsent, follow

PROJECT = Path(__file__).parents[2]


def wait_until_sent(sender):
    """All that is written now has been sent, and the sender knows."""
    wait_until(lambda: sender.state.is_sending, lambda: sender.state)
    wait_until(lambda: not count_unsent(sender._path).waiting, lambda: sender.state)
    wait_until(lambda: sender.state.problem is None, lambda: sender.state)


def sent(file, database):
    """Send all that is written now; the history on the server."""
    with sending(file, database) as sender:
        wait_until_sent(sender)
    return History(database)


@pytest.fixture
def history(tmp_path):
    return HistoryFile(tmp_path / "history.sqlite")


@pytest.fixture
def full(tmp_path):
    return filled(tmp_path)


def test_what_changes_and_what_goes_follows(history, database):
    fill(history)
    with sending(history, database) as sender:
        wait_until_sent(sender)
        keep_told_level(history, VALVE, Level.OK)
        forget_moves_after(history, VALVE, service_move(1).end)
        keep_answers(history, VALVE, 0.02, [answer(1, 0.5)])
        retagged = VALVE._replace(tag="FV-101-B")
        keep_moves(history, retagged, BUILT, [service_move(1)])
        wait_until_sent(sender)
        server = History(database)
        assert server.valves() == (retagged,)
        assert read_told_level(server, VALVE.name) is Level.OK
        assert len(read_moves(server, VALVE.name, BUILT)) == 2
        assert {one.dead_time for one in read_answers(server, VALVE.name)} >= {0.5}
        keep_renewal(history, VALVE, START + DAY)
        wait_until_sent(sender)
        assert read_moves(server, VALVE.name, BUILT) == ()
        assert read_answers(server, VALVE.name) == ()


def test_the_server_keeps_what_the_file_forgets(history, database):
    history.add(success())
    with sending(history, database) as sender:
        wait_until_sent(sender)
        history.add(success(START + 9 * DAY), days=1.0)
        wait_until_sent(sender)
    assert [len(one.entries()) for one in (history, History(database))] == [1, 2]


def test_a_file_without_a_server_keeps_no_list(history):
    fill(history)
    assert count_unsent(history.path) == (0, None, 0)


def test_each_row_waits_once_since_it_first_changed(history):
    history.prepare()
    follow(history.path)
    for level in (Level.OK, Level.WARN, Level.ERROR):
        keep_told_level(history, VALVE, level)
    history.add(success())
    before = time.time()
    count = count_unsent(history.path)
    assert count.waiting == 3  # the valve, its level, an identification
    assert before - 60 < count.since <= before
    change(history, "UPDATE unsent SET since = 5 WHERE part = 'told_level'")
    keep_told_level(history, VALVE, Level.OK)
    assert count_unsent(history.path) == (3, 5, 0)


class TestFaults:
    def test_a_server_that_is_away(self, history, database, postgres):
        """Rows wait, the reason is told once, and they arrive when it returns."""
        history.add(success())
        postgres.stop()
        try:
            with sending(history, database) as sender:
                wait_until(lambda: sender.state.problem)
                assert "check that the server runs" in sender.state.problem
                assert sender.state.count.waiting == 2
                news = sender.news()
                assert news.startswith(f"the history waits in {history.path}: {database}: ")
                assert sender.news() is None
                begun = time.monotonic()
                told = sender.take(VALVE)
                assert told == sender.state.problem
                assert time.monotonic() - begun < 5.0
                postgres.start()
                wait_until_sent(sender)
                assert sender.news() == f"{database}: the history is being sent again"
        finally:
            postgres.start()
        assert all_of(History(database)) == all_of(history)

    def test_killed_and_paused_under_load(self, history, database, postgres):
        """The one who writes is not held up, and each row arrives once."""
        slowest, stop, written = [0.0], threading.Event(), []

        def load():
            while not stop.is_set():
                begun = time.monotonic()
                number = len(written)
                entry = success if number % 3 else refused
                history.add(entry(START + number))
                written.append(number)
                slowest.append(time.monotonic() - begun)
                time.sleep(0.01)

        history.prepare()
        writer = threading.Thread(target=load)
        writer.start()
        try:
            with sending(history, database) as sender:
                wait_until(
                    lambda: History(database).entries() if sender.state.is_sending else False
                )
                for _ in range(2):
                    postgres.kill()
                    count = len(written)
                    wait_until(lambda: sender.state.problem and len(written) > count + 20)  # noqa: B023
                    postgres.start()
                    wait_until(lambda: sender.state.problem is None)
                with postgres.paused():
                    count = len(written)
                    wait_until(lambda: len(written) > count + 50)
                stop.set()
                writer.join()
                wait_until_sent(sender)
        finally:
            stop.set()
            writer.join()
        assert max(slowest) < 3.0  # the patience of a writer: it waits for no server
        assert len(history.entries()) == len(written)
        assert all_of(History(database)) == all_of(history)

    def test_a_sender_that_is_killed(self, history, database):
        """At any instant, also between the server's commit and what the file notes of it."""
        written, folder, name = 0, history.path.parent, history.path.name
        for run in range(3):
            process = writer("sent", folder, database.url, 1_000_000, f"{name}={run}")
            for _ in range(30 + 17 * run):
                assert process.stdout.readline().strip()
            process.send_signal(signal.SIGKILL)
            process.wait()
            process.stdout.close()
            assert len(history.entries()) > written
            written = len(history.entries())
        assert all_of(sent(history, database)) == all_of(history)
        assert is_same(copied(history.path, database))

    def test_all_is_sent_again_to_a_server_that_is_another(self, history, database, postgres):
        """What it has already, as after a kill before the file notes it, is not doubled."""
        fill(history)
        sent(history, database)
        change(history, "UPDATE mark SET value = 'another' WHERE name = 'sent_to'")
        other = HistoryServer(postgres.url(postgres.database()))
        for number, server in enumerate((database, other)):
            history.add(success(START + 50 + number))
            assert all_of(sent(history, server)) == all_of(history)

    def test_a_full_disk_of_the_server(self, history, database, postgres):
        with sending(history, database) as sender:
            history.add(success())
            wait_until_sent(sender)
            postgres.do(
                database_of(database),
                "CREATE FUNCTION full_disk() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN RAISE "
                "'could not extend file: No space left on device' USING ERRCODE = '53100'; END $$;"
                "CREATE TRIGGER full_disk BEFORE INSERT ON parameter "
                "EXECUTE FUNCTION full_disk();",
            )
            history.add(success(START + 1))
            wait_until(lambda: sender.state.problem)
            assert "make room on the disk of the server" in sender.state.problem
            assert sender.state.count.refused == 0
            assert len(History(database).entries()) == 1
            postgres.do(database_of(database), "DROP TRIGGER full_disk ON parameter")
            wait_until_sent(sender)
        assert all_of(History(database)) == all_of(history)

    def test_a_row_that_the_server_refuses_holds_up_no_other(self, history, database, postgres):
        history.add(success())
        with sending(history, database) as sender:
            wait_until_sent(sender)
            postgres.do(
                database_of(database), "ALTER TABLE identification ADD CHECK (method != 'best')"
            )
            for number, method in enumerate(("bench", "best", "plant"), 1):
                history.add(success(START + number, method=method))
            wait_until_sent(sender)
            wait_until(lambda: sender.state.count.refused == 1)
        assert [one.method for one in History(database).entries()] == ["bench", "bench", "plant"]

    def test_a_file_that_is_removed_begins_anew(self, history, database):
        history.add(success())
        with sending(history, database) as sender:
            wait_until_sent(sender)
            for path in history.path.parent.glob(f"{history.path.name}*"):
                path.unlink()
            wait_until(lambda: sender.state.problem is None and history.path.exists())
            history.add(success(START + 1))
            wait_until(lambda: len(History(database).entries()) == 2, lambda: sender.state)


def test_ten_writers(tmp_path, database):
    """Of ten machines, as it were, one valve among them twice: all arrive, once."""
    number = 60
    places = [f"{k}.sqlite={k % 9}" for k in range(10)]
    with writer("sent", tmp_path, database.url, number, *places) as process:
        process.communicate(timeout=300)
    assert process.returncode == 0
    server = History(database)
    assert len(server.valves()) == 9
    counts = {valve.name: len(server.entries([valve.name])) for valve in server.valves()}
    assert counts.pop("/fv_0/identifier") == 2 * number
    assert set(counts.values()) == {number}
    for k in range(10):
        assert all(
            one.rows == one.same
            for one in copied(tmp_path / f"{k}.sqlite", database)
            if one.table in ("identification", "baseline")
        )


class TestAnotherMachine:
    def test_a_valve_is_taken_where_it_was_kept_elsewhere(self, full, database, tmp_path):
        with sending(full, database) as sender:
            assert sender.take(VALVE) is None
            wait_until_sent(sender)
        second = HistoryFile(tmp_path / "second.sqlite")
        with sending(second, database) as sender:
            assert sender.take(VALVE) is None
            assert second.valves() == (VALVE,)
            assert all_of(second)[2:10] == all_of(full)[2:10]
            assert count_unsent(second.path).waiting == 0
            second.set_baseline(VALVE, KeptBaseline(Baseline(99.0), START + 90, START + 90))
            keep_told_level(second, VALVE, Level.WARN)
            wait_until_sent(sender)
        with sending(full, database) as sender:  # and back
            assert sender.take(VALVE) is None
            assert full.baseline(VALVE.name).baseline.coulomb_friction == 99.0
            assert read_told_level(full, VALVE.name) is Level.WARN
            assert read_told_level(full, OTHER.name) is Level.ERROR
            wait_until_sent(sender)
        assert all_of(History(database)) == all_of(full)

    def test_its_own_rows_are_not_taken_again(self, history, database):
        history.add(success())
        with sending(history, database) as sender:
            assert sender.take(VALVE) is None
            history.add(success(START + 9 * DAY), days=1.0)
            assert sender.take(VALVE) is None
            wait_until_sent(sender)
        assert len(history.entries()) == 1

    @pytest.mark.slow
    def test_a_server_that_stands_still_is_not_waited_for(self, history, database, postgres):
        with sending(history, database) as sender:
            assert sender.take(VALVE) is None
            begun = time.monotonic()
            with postgres.paused():
                told = sender.take(OTHER)
            assert str(database) in told
            assert time.monotonic() - begun < 30.0

    def test_two_processes_of_one_file_share_a_sender(self, history, database):
        with sending(history, database) as sender:
            wait_until(lambda: sender.state.is_sending)
            code = (
                "import sys, time; sys.path.insert(0, sys.argv[3])\n"
                "from pathlib import Path\n"
                "from valve_friction_ros.history import *\n"
                "sender = sender_of(Path(sys.argv[1]), HistoryServer(sys.argv[2]))\n"
                "print(sender.take(KeptValve('/fv_9/identifier', 'FV-9')))\n"
                "print(sender.state.is_sending); sender.end()\n"
            )
            found = printed("-c", code, history.path, database.url, PROJECT)
            assert found.split() == ["None", "False"]
            assert sender_of(history.path, database) is sender
            sender.end()
            assert sender.state.is_sending


@pytest.fixture(params=["file", "server"])
def other(request, tmp_path):
    """A place for a copy."""
    if request.param == "file":
        return tmp_path / "folder" / "copy.sqlite"
    return request.getfixturevalue("database")


def is_same(parts):
    return all(one.is_same for one in parts)


def test_there_and_back_is_the_same(full, other, tmp_path):
    there = copied(full.path, other)
    assert {one.table: one.rows for one in there} == {
        "identification": 6,
        "baseline": 4,
        "packing_renewal": 2,
        "usage": 6,
        "alarm_recording": 2,
        "told_level": 2,
        "alarm_event": 4,
        "move": 8,
        "evidence_reference": 2,
        "evidence_change": 2,
        "answer": 6,
    }
    assert [one.rows for one in there] == [one.written for one in there]
    back = copied(other, tmp_path / "back.sqlite")
    assert is_same(there)
    assert is_same(back)
    assert [one.checksum for one in there] == [one.copied for one in back]
    assert all_of(HistoryFile(tmp_path / "back.sqlite")) == all_of(History(other)) == all_of(full)
    assert [one.written for one in copied(full.path, other)] == [0] * 11


def test_one_valve_alone(full, other):
    parts = copied(full.path, other, [OTHER.name])
    assert History(other).valves() == (OTHER,)
    assert {one.table: one.rows for one in parts}["identification"] == 3
    copied(full.path, other)
    assert all_of(History(other)) == all_of(full)


def test_rows_from_elsewhere_stay(full, other, tmp_path):
    """Two machines that keep one valve by mistake, also at the same instant, lose nothing."""
    second = HistoryFile(tmp_path / "second.sqlite")
    second.add(success(START, 222.0))
    assert is_same(copied(full.path, other))
    assert is_same(copied(second.path, other))
    assert is_same(copied(full.path, other))
    found = [one.values.get("coulomb_friction") for one in History(other).entries([VALVE.name])]
    assert sorted(filter(None, found)) == [150.0, 150.123456789, 222.0]


def test_a_row_that_changes_is_written_again(full, other):
    copied(full.path, other)
    keep_told_level(full, VALVE, Level.WARN)
    parts = copied(full.path, other)
    assert {one.table: one.written for one in parts if one.written} == {"told_level": 1}
    assert read_told_level(History(other), VALVE.name) is Level.WARN
    assert read_told_level(History(other), OTHER.name) is Level.ERROR


def test_a_row_that_was_changed_there_is_told(full, tmp_path):
    """What is kept is never changed; so a copy that differs is said to."""
    target = tmp_path / "copy.sqlite"
    copied(full.path, target)
    change(HistoryFile(target), "UPDATE parameter SET value = 1.0 WHERE value = 150.123456789")
    parts = {one.table: one for one in copied(full.path, target)}
    assert (parts["identification"].rows, parts["identification"].same) == (6, 4)
    assert [name for name, one in parts.items() if not one.is_same] == ["identification"]


def test_ends_that_cannot_be(full, tmp_path):
    with pytest.raises(HistoryError, match="both source and target"):
        copied(full.path, full.path)
    with pytest.raises(HistoryError, match="there is no such file"):
        copied(tmp_path / "none.sqlite", full.path)


@pytest.mark.parametrize("version", [2, 5, 6, 7])
def test_a_file_of_an_older_version_is_copied_and_stays_as_it_is(version, other, tmp_path):
    if version == 5:
        make_version_5(old := filled(tmp_path))
    else:
        old = make_version(version, HistoryFile(tmp_path / "old.sqlite"))
    content, before = old.path.read_bytes(), all_of(old)
    assert is_same(copied(old.path, other))
    assert all_of(History(other)) == before
    assert [one.written for one in copied(old.path, other)] == [0] * 11
    assert old.path.read_bytes() == content
    old.add(success(START + 99))  # which changes its tables, and not its keys
    parts = copied(old.path, other)
    assert {one.table: one.written for one in parts if one.written} == {"identification": 1}
    assert is_same(parts)


class KilledError(Exception):
    """Ends a copy between two of its transactions."""


def test_a_copy_that_ends_early_goes_on(full, other, monkeypatch):
    monkeypatch.setattr(copying, "_MANY", 7)
    for number in range(40):
        full.add(success(START + 100 + number))
    write, count = copying.write_rows, [0]

    def write_some(*arguments):
        count[0] += 1
        if count[0] > 2:
            raise KilledError
        write(*arguments)

    monkeypatch.setattr(copying, "write_rows", write_some)
    for _ in range(3):
        count[0] = 0
        with pytest.raises(KilledError):
            copied(full.path, other)
    monkeypatch.undo()
    assert is_same(parts := copied(full.path, other))
    assert 0 < parts[0].written < parts[0].rows
    assert all_of(History(other)) == all_of(full)


_TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
_NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@pytest.fixture(scope="module")
def any_database(postgres):
    """One for all examples."""
    return HistoryServer(postgres.url(postgres.database()))


@settings(max_examples=25)
@given(st.lists(st.tuples(_TEXTS, _NUMBERS, _NUMBERS), min_size=1, max_size=4))
def test_any_value_arrives(any_database, tmp_path_factory, rows):
    file = HistoryFile(tmp_path_factory.mktemp("any") / "history.sqlite")
    for number, (text, value, width) in enumerate(rows):
        kept = {} if math.isnan(value + width) else {"lag": Measured(value, width)}
        file.add(success(START + number, warnings=(text,), numbers=kept))
    assert is_same(copied(file.path, any_database))
