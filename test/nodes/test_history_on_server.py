# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""An identifier whose history goes to a server: there, away, and from another machine."""

import subprocess
import sys
from pathlib import Path

from histories import START, VALVE, success
from live_nodes import NAMESPACE, values_of
from records import quick_record

from valve_friction_ros.health import Baseline
from valve_friction_ros.history import History, HistoryFile, KeptBaseline, copied, sender_of
from valve_friction_ros.history.outbox import count_unsent

NODE = f"{NAMESPACE}/identifier"
NAME = "VALVE_FRICTION_HISTORY_URL"
RECORD = quick_record()


def sent(client, history):
    """Wait until nothing waits, and the diagnostics say so: they lag by a second."""
    return client.status_values(
        lambda status: (
            not count_unsent(history.path).waiting
            and values_of(status).get("history_server waiting") == "0"
            and values_of(status)["history_server problem"] == ""
        ),
        "a history that was sent",
    )


def test_rows_arrive_and_wait_while_the_server_is_away(live, history, database, postgres):
    node = live.start_identifier({"history_url": database.url})
    client = live.client
    client.identified(RECORD)
    assert client.trigger("set_baseline").success
    values = sent(client, history)
    assert values["history_server"] == str(database)
    assert len(History(database).entries()) == len(history.entries())
    postgres.kill()
    try:
        client.identified(RECORD)  # answered as ever
        values = client.status_values(
            lambda status: (
                int(values_of(status)["history_server waiting"]) > 0
                and values_of(status)["history_server problem"]
            ),
            "rows that wait",
        )
        assert "check that the server runs" in values["history_server problem"]
        assert values["history_server waiting since [time]"].startswith("20")
    finally:
        postgres.start()
    sent(client, history)
    assert all(one.is_same for one in copied(history.path, database))
    assert f"the history waits in {history.path}" in node.errors


def test_without_a_server_it_starts_and_says_so(live, history, database, postgres):
    history.set_baseline(VALVE, KeptBaseline(Baseline(152.7, 1.0), START, START))
    postgres.stop()
    try:
        live.start_identifier({"history_url": database.url})
        values = live.client.status_values(what="the first diagnostic")
        assert str(database) in values["history_server not taken"]
        assert float(values["baseline_coulomb_friction [N]"]) == 152.7
    finally:
        postgres.start()


def test_what_another_machine_kept_is_taken(live, history, database, tmp_path):
    other = HistoryFile(tmp_path / "other.sqlite")
    other.set_baseline(VALVE, KeptBaseline(Baseline(152.7, 1.0), START, START))
    other.add(success(baseline=Baseline(152.7, 1.0)))
    sender = sender_of(other.path, database)
    assert sender.take(VALVE) is None
    sender.end()
    live.start_identifier({"history_url": database.url})
    values = live.client.status_values(what="the first diagnostic")
    assert float(values["baseline_coulomb_friction [N]"]) == 152.7
    assert values["estimate_from"] == "before the restart"
    assert "history_server not taken" not in values
    assert len(history.entries()) == 1


def test_a_password_in_a_parameter_is_refused(live):
    node = live.start("identifier", {"history_url": "postgresql://me:s3cret@host/db"})
    live.client.watched.clear()
    assert node.exit_code() == 2
    live.nodes.remove(node)
    assert "history_url holds a password" in node.errors
    assert "s3cret" not in node.errors


def test_a_password_of_the_environment_is_never_shown(live, database, postgres, monkeypatch):
    url = postgres.url(database.url.rpartition("/")[2], "nobody", "s3cret")
    monkeypatch.setenv(NAME, url)
    node = live.start_identifier()
    values = live.client.status_values(
        lambda status: values_of(status).get("history_server problem"), "a problem"
    )
    assert "check user and password" in values["history_server problem"]
    assert "s3cret" not in str(values)
    assert "s3cret" not in node.errors
    assert "s3cret" not in str(live.client.parameters(NODE, "history_url"))


def test_without_an_address_the_library_is_not_loaded():
    code = "import sys, valve_friction_ros.nodes.identifier.node; print('psycopg' in sys.modules)"
    project = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=project, capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"
