# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The report of the last estimate: drawn from its own record, whatever came since."""

import re
import time
from pathlib import Path

import pytest
from histories import DAY, success
from live_nodes import NODE
from pages import PageReader
from records import quick_record

from valve_friction_ros.health import Baseline
from valve_friction_ros.history import HistoryFile, KeptBaseline, KeptValve
from valve_friction_ros.model import HIGH_FRICTION


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

    low = quick_record()
    message = client.identified(low)
    path, page = report(client)
    assert path.parent == folder
    assert re.fullmatch(r"fv_101_\d{8}T\d{6}Z\.html", path.name)
    page.require_self_contained()
    assert page.said("h1") == ["Friction of fv_101"]
    assert page.table("friction")["diagnosis"] == (message,)
    assert page.table("record")["samples"][0].startswith(f"{len(low)}, ")
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
    high = quick_record(HIGH_FRICTION)
    client.identified(high)
    _, other = report(client)
    assert other.table("record") != page.table("record")
    assert other.pictures()[0] != page.pictures()[0]


def test_friction_is_judged_against_the_baseline_in_force(bench):
    client, _ = bench
    client.set_baseline(quick_record())
    message = client.identified(quick_record(HIGH_FRICTION))
    _, page = report(client)
    assert page.status[:3] == ("red", "✗", "Excess friction")
    assert page.lead.startswith("The friction is excessive, ")
    assert [one for one in page.said("figcaption") if "Grey: the record of the baseline" in one]
    assert page.table("friction")["level"] == ("ERROR, NE 107 status signal F",)
    (shown,) = page.table("friction")["diagnosis"]
    assert message.startswith(shown)  # and what else was found


def test_the_trend_and_the_signature_of_the_baseline_are_those_of_the_history(live, tmp_path):
    """Also after a restart: identifications of five days before, and the record of a baseline."""
    kept = HistoryFile(tmp_path / "history.sqlite")
    valve = KeptValve(NODE, "FV-101")
    healthy, now = Baseline(150.0, 2.0), time.time_ns()
    record = KeptBaseline.thin(quick_record())
    kept.set_baseline(valve, KeptBaseline(healthy, now - 40 * DAY, now - 40 * DAY, record))
    for days in range(35, 5, -5):
        friction = 150.0 + 2.0 * (35 - days)
        kept.add(success(now - days * DAY, friction, 2.0, valve=valve, method="plant"))
    places = {"report_folder": str(tmp_path), "history_file": str(kept.path)}
    client = live.client_of_identifier({**places})
    client.identified(quick_record(HIGH_FRICTION))
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
