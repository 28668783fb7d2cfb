# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alarm recordings and reports over DDS: bags and pages, bounded, named, also after a restart."""

import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from faulty_identifier import faulty
from histories import DAY, VALVE, success
from histories import START as DAWN
from live_nodes import ERROR, NODE, SECOND, START, values_of
from pages import PageReader
from records import quick_record
from rosbags.rosbag2 import Reader

from valve_friction_ros.health import Baseline, Level
from valve_friction_ros.history import (
    AlarmRecording,
    HistoryFile,
    KeptBaseline,
    KeptValve,
    alarm_recordings,
    keep_alarm_recording,
)
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.nodes.identifier.recordings import _LATE

TICK = 1.0
"""Period of the diagnostics, s."""
HEALTHY, TIGHT = quick_record(), quick_record(HIGH_FRICTION)
FAST = {"method": "bench", "alarm_recording": 0.1, "alarm_pause": 0.0}


def baseline_set(live, parameters, script=None):
    """Start a node with the healthy valve as its baseline."""
    node = live.start_identifier({**FAST, **parameters}, script=script)
    live.client.set_baseline(HEALTHY)
    return node


def recorded(client, before=None):
    """Wait for another recording than the one before; its path."""
    key = "alarm_recording"
    values = client.status_values(
        lambda one: values_of(one).get(key, before) != before, "a recording of the alarm"
    )
    return Path(values[key])


def restarted(live, node, parameters):
    """Start the node again, with other parameters and the baseline that it has kept."""
    live.client.watched.clear()
    node.stop()
    live.nodes.remove(node)
    live.client.statuses.clear()
    node = live.start_identifier({**FAST, **parameters})
    live.client.next_status()
    return node


def alarmed(client, before=None):
    """Raise an alarm, and wait for its recording."""
    client.identified(HEALTHY)
    client.identified(TIGHT)
    return recorded(client, before)


def paged(client, path):
    """Wait for the page of a recording; its text."""
    page = Path(path) / "report.html"
    client.wait_until(page.exists, f"{page}", timeout=300)
    return page.read_text(encoding="utf-8")


def wait_beyond_a_recording(client):
    """Wait until one that has begun would have been written."""
    end = time.monotonic() + FAST["alarm_recording"] + _LATE + 2 * TICK
    client.wait_until(lambda: time.monotonic() > end, "the end of a recording")
    client.next_status()
    client.next_status()


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def samples_in(bag):
    with Reader(bag) as reader:
        return reader.message_count


@pytest.mark.slow
def test_an_alarm_is_recorded_and_the_whole_takes_the_place_of_its_first_part(live, history):
    baseline_set(live, {"alarm_recording": 10.0, "alarm_recordings": 1})
    client = live.client
    client.identified(TIGHT)
    assert client.statuses[-1][1].level == ERROR
    folder = history.path.with_name("alarms")
    client.wait_until(lambda: [*folder.glob("alarm_*")], "the first part")
    assert "alarm_recording" not in client.last_values()  # what comes after is awaited
    client.send_record(TIGHT, START + 5 * SECOND)
    path = recorded(client)
    assert path.parent == folder
    assert names(folder) == [path.name]
    assert samples_in(path) == 4 * len(TIGHT)
    assert path.name.startswith("alarm_fv_101_")
    assert path.name.endswith("_ERROR")
    values = client.last_values()
    assert values["alarm_recording level"] == "ERROR"
    assert values["alarm_recording [time]"][:10].count("-") == 2
    assert "Excess friction" in paged(client, path)
    (kept,) = client.wait_until(lambda: alarm_recordings(history, NODE), "a row of the alarm")
    assert kept.path == path
    assert kept.message.startswith("excess friction")


def test_what_was_before_an_alarm_outlives_a_kill(live, history):
    """Killed before the time after the rise is over; what a kill left is neither half nor lost."""
    node = baseline_set(live, {"alarm_recording": 600.0})
    client, folder = live.client, history.path.with_name("alarms")
    client.identified(TIGHT)
    (kept,) = client.wait_until(lambda: alarm_recordings(history, NODE), "a row of the alarm")
    live.kill(node)
    assert names(folder) == [kept.path.name]
    assert samples_in(kept.path) == 2 * len(TIGHT)
    live.start_identifier(FAST)
    values = client.status_values(lambda one: "alarm_recording" in values_of(one), "its name")
    assert values["alarm_recording"] == str(kept.path)
    assert values["alarm_recording level"] == "ERROR"


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 64 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("this user may not mount a small disk")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("reason", ["No space left on device", "Not a directory"])
def test_what_cannot_be_written_is_told_and_no_torn_bag_stays(
    live, history, tmp_path, reason, request
):
    if reason.startswith("No space"):
        folder = request.getfixturevalue("small_disk")
    else:
        (tmp_path / "file").touch()
        folder = tmp_path / "file" / "alarms"
    node = baseline_set(live, {"alarm_folder": str(folder)})
    client = live.client
    client.identified(TIGHT)
    problem = "alarm_recording problem"
    values = client.status_values(lambda one: problem in values_of(one), "what hinders it")
    assert values[problem].startswith(
        f"the alarm was not recorded: cannot write an alarm's recording into {folder}: {reason}: "
    )
    wait_beyond_a_recording(client)
    assert not folder.exists() or names(folder) == []
    assert "alarm_recording" not in client.last_values()
    assert alarm_recordings(history, NODE) == ()
    restarted(live, node, {"alarm_folder": str(tmp_path / "room")})
    assert alarmed(client).parent == tmp_path / "room"
    assert problem not in client.last_values()


def test_it_is_named_after_a_restart(live, history, tmp_path):
    """The level that a node begins with is none that has risen."""
    history.add(success(friction=400.0))
    history.set_baseline(VALVE, KeptBaseline(Baseline(100.0, 1.0), DAWN, DAWN))
    one = AlarmRecording(DAWN, Level.ERROR, tmp_path / "alarms" / "one", "excess friction")
    keep_alarm_recording(history, VALVE, one)
    live.start_identifier(FAST)
    status = live.client.next_status()
    assert status.level == ERROR
    values = values_of(status)
    assert values["alarm_recording"] == str(one.path)
    assert values["alarm_recording [time]"] == "2026-09-21T14:13:20Z"
    live.client.fill(TIGHT)
    live.client.next_status()
    assert alarm_recordings(history, NODE) == (one,)
    assert not history.path.with_name("alarms").exists()


@pytest.mark.slow
def test_many_alarms_are_bounded_and_nothing_else_is_removed(live, tmp_path):
    folder = tmp_path / "plant" / "alarms"
    others = [
        "alarm_fv_101_20200101T000000Z_ERROR",  # with a note in it
        "alarm_fv_1_20200101T000000Z_ERROR",  # of another valve
        "alarm_fv_101_notes",
    ]
    for name in others:
        (folder / name).mkdir(parents=True)
        (folder / name / "metadata.yaml").touch()
    (folder / others[0] / "note.txt").touch()
    chosen = {"alarm_folder": str(folder), "alarm_recordings": 2}
    node = baseline_set(live, chosen)
    client, path, paths = live.client, None, []
    for _ in range(4):
        path = str(alarmed(client, path))
        paged(client, path)
        paths.append(Path(path).name)
    assert len(set(paths)) == 4
    assert names(folder) == sorted([*others, paths[0], paths[-1]])  # of one level in a row
    size = sum(one.stat().st_size for one in Path(path).iterdir())

    node = restarted(live, node, {**chosen, "alarm_megabytes": 1.5 * size / 1e6})
    path = str(alarmed(client, path))
    expected = sorted([*others, Path(path).name])
    client.wait_until(lambda: names(folder) == expected, "one recording", timeout=300)
    assert "Excess friction" in paged(client, path)
    restarted(live, node, {**chosen, "alarm_megabytes": 0.001})
    client.identified(HEALTHY)
    client.identified(TIGHT)
    problem = "MB has no room in alarm_megabytes (0.001): raise it"
    client.next_status(
        lambda one: problem in values_of(one).get("alarm_recording problem", ""), "no room"
    )
    client.wait_until(lambda: names(folder) == sorted(others), "no recording")


@pytest.mark.slow
def test_a_level_that_flaps_is_recorded_once(live):
    baseline_set(live, {"alarm_pause": 3600.0})
    client = live.client
    path = alarmed(client)
    for _ in range(2):
        client.identified(HEALTHY)
        client.identified(TIGHT)
    client.next_status()
    client.next_status()
    assert names(path.parent) == [path.name]


@pytest.mark.slow
def test_what_is_not_recorded(live, tmp_path):
    """Silent inputs, the end of a packing's life, and friction where it is switched off."""
    node = live.start_identifier({**FAST, "reversal_limit": 1.0})
    client = live.client
    turns = np.tile(np.linspace(0.0, BENCH_VALVE.travel, 64), 16)
    client.send(position=(START + SECOND * np.arange(turns.size), turns))
    client.next_status(lambda one: "packing life" in one.message, "the limit")
    assert client.set_together(NODE, {"input_timeout": 0.1}).successful
    client.next_status(lambda one: "no data on" in one.message, "silent inputs")
    wait_beyond_a_recording(client)
    assert "alarm_recording" not in client.last_values()
    restarted(live, node, {"alarm_recording": 0.0})
    assert client.set_together(NODE, {"baseline_in_alarm": True}).successful
    client.set_baseline(HEALTHY)
    client.identified(TIGHT)
    assert client.statuses[-1][1].level == ERROR
    wait_beyond_a_recording(client)
    assert "alarm_recording" not in client.last_values()
    assert not (tmp_path / "valve_friction_ros" / "alarms").exists()


def test_a_fault_in_the_page_is_told_as_that_and_the_bag_is_there(live):
    baseline_set(live, {}, script=faulty("pageless")).forgive_tracebacks()
    client = live.client
    client.identified(TIGHT)
    values = client.status_values(
        lambda one: "alarm_recording problem" in values_of(one), "the fault in the page"
    )
    problem = values["alarm_recording problem"]
    assert problem.startswith("the page was not written: internal error: ZeroDivisionError")
    assert (Path(values["alarm_recording"]) / "metadata.yaml").exists()


# Reports of the last estimate, drawn from its own record, whatever came since


def report(client):
    """Ask for a report; its path and its page."""
    response = client.success("report")
    path = Path(response)
    return path, PageReader(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def bench(shared, tmp_path_factory):
    """A node, its client, and the folder of its reports, which is not there yet."""
    folder = tmp_path_factory.mktemp("reported") / "plant" / "reports"
    shared.start_identifier({"report_folder": str(folder)})
    return shared.client, folder


@pytest.mark.slow
def test_the_last_estimate_is_drawn_from_its_own_record(bench):
    client, folder = bench
    assert client.refusal("report") == "the valve has no result to report: identify it first"
    assert not folder.exists()

    message = client.identified(HEALTHY)
    path, page = report(client)
    assert path.parent == folder
    assert re.fullmatch(r"fv_101_\d{8}T\d{6}Z\.html", path.name)
    page.require_self_contained()
    assert page.said("h1") == ["Friction of fv_101"]
    assert page.table("friction")["diagnosis"] == (message,)
    assert page.table("record")["samples"][0].startswith(f"{len(HEALTHY)}, ")
    assert page.table("record")["source"][0].startswith(f"node {NODE}, identified ")

    # The buffer moves on, and a record that cannot be identified changes only the notes.
    client.empty_the_buffer()
    assert client.trigger("identify").success is False
    again, later = report(client)
    assert again == path.with_name(f"{path.stem}_2.html")
    assert later.pictures()[1:] == page.pictures()[1:]  # the first one is the trend
    assert later.table("parameter") == page.table("parameter")
    new = set(later.said("p")) - set(page.said("p"))
    (note,) = (text for text in new if " identifications on " not in text)
    assert note.startswith("a later record was refused: ")
    assert [text for text in new if " identifications on 1 day. " in text]

    # The next estimate takes its place.
    client.identified(TIGHT)
    _, other = report(client)
    assert other.table("record") != page.table("record")
    assert other.pictures()[0] != page.pictures()[0]


def test_friction_is_judged_against_the_baseline_in_force(bench):
    client, _ = bench
    client.set_baseline(HEALTHY)
    message = client.identified(TIGHT)
    _, page = report(client)
    assert page.status[:3] == ("red", "✗", "Excess friction")
    assert page.lead.startswith("Replace the packing as soon as possible")
    assert [one for one in page.said("figcaption") if "Grey: the record of the baseline" in one]
    assert page.table("friction")["level"] == ("ERROR, NE 107 status signal F",)
    (shown,) = page.table("friction")["diagnosis"]
    assert message.startswith(shown)  # and what else was found


def test_the_trend_and_the_signature_of_the_baseline_are_those_of_the_history(live, tmp_path):
    """Also after a restart: identifications of five days before, and the record of a baseline."""
    kept = HistoryFile(tmp_path / "history.sqlite")
    valve = KeptValve(NODE, "FV-101")
    healthy, now = Baseline(150.0, 2.0), time.time_ns()
    record = KeptBaseline.thin(HEALTHY)
    kept.set_baseline(valve, KeptBaseline(healthy, now - 40 * DAY, now - 40 * DAY, record))
    for days in range(35, 5, -5):
        friction = 150.0 + 2.0 * (35 - days)
        kept.add(success(now - days * DAY, friction, 2.0, valve=valve, method="plant"))
    places = {"report_folder": str(tmp_path), "history_file": str(kept.path)}
    client = live.client_of_identifier(places)
    client.identified(TIGHT)
    _, page = report(client)
    assert page.said("h2")[2:4] == ["Friction compared with its baseline", "Trend"]
    (told,) = (text for text in page.said("p") if "Drift of the " in text)
    assert re.match(r"[78] identifications on 7 days\. Drift of the Coulomb friction: \+", told)
    assert [one for one in page.said("figcaption") if "Grey: the record of the baseline" in one]
    assert any("; identified 20" in text for text in page.said("p"))

    # Another baseline than that of the history has no record, and a lost history no trend.
    (done,) = client.set_parameters(NODE, {"baseline_coulomb_friction": 140.0})
    assert done.successful
    kept.path.write_bytes(b"no database" * 100)
    _, page = report(client)
    assert "Trend" not in page.said("h2")
    assert not [one for one in page.said("figcaption") if "Grey" in one]
    assert [
        text for text in page.said("p") if text.startswith("no trend, because the history cannot")
    ]
