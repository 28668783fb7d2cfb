# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What an identifier keeps, in a file and on a server, and takes over when it starts again."""

import math

import pytest
from histories import DAY, START, VALVE, as_kept, success
from live_nodes import NODE, OK, WARN, values_of
from records import quick_record

from valve_friction_ros.health import Baseline, DatedNumber, SlidingFriction
from valve_friction_ros.history import (
    MONTH,
    History,
    HistoryFile,
    KeptBaseline,
    copied,
    sender_of,
    trend_of,
)
from valve_friction_ros.history.outbox import count_unsent
from valve_friction_ros.history.status_values import trend_values
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE

RECORD = quick_record()
RESULT = identify(RECORD, BENCH_VALVE)
EXPECTED = as_kept(RESULT.parameters["coulomb_friction"])


def logged(live, process, words):
    """Wait for lines of a node's log that hold these words."""
    lines = lambda: [line for line in process.errors.splitlines() if words in line]  # noqa: E731
    return live.client.wait_until(lines, f"{words!r} in the log")


def first_values(live):
    return live.client.status_values(what="the first diagnostic")


def test_success_and_refusal_are_kept(live, history):
    client = live.client_of_identifier({"valve_tag": "FV-101", "window": 70.0})
    refusal = client.trigger("identify").message
    client.identified(RECORD)
    entries = history.entries()
    assert {entry.valve for entry in entries} == {VALVE}
    assert refusal in (entries[0].refusal, entries[1].refusal)
    last = entries[-1]
    assert last.friction == EXPECTED
    assert last.method == "plant"
    assert (last.span.end - last.span.begin) / 1e9 == pytest.approx(4.99)
    assert last.diagnosis.message == client.statuses[-1][1].message
    assert '"window": 70.0' in last.settings
    times = [entry.time for entry in entries]
    assert times == sorted(times)
    stamp, _ = client.statuses[-1]
    assert abs(stamp.sec - last.time / 1e9) < 60


class TestBaseline:
    def test_a_parameter_comes_first(self, live, history):
        history.set_baseline(VALVE, KeptBaseline(Baseline(152.7, 1.0), START, START))
        node = live.start_identifier({"baseline_coulomb_friction": 140.0})
        assert float(first_values(live)["baseline_coulomb_friction [N]"]) == 140.0
        (line,) = logged(live, node, "baseline Coulomb friction 140 N")
        assert "from the parameter baseline_coulomb_friction" in line
        assert "not used: baseline Coulomb friction 152.7 ± 1.0 N, set 2026-09-21 14:13 UTC" in line

    def test_one_of_the_sliding_friction_alone_ends_with_nan(self, live, history):
        """The parameter shows nan all the time; only setting it ends the baseline."""
        alone = Baseline(sliding=SlidingFriction(200.0, 4.0, 8e-3))
        history.set_baseline(VALVE, KeptBaseline(alone, START, START))
        live.start_identifier()
        key, client = "baseline_sliding_friction [N]", live.client
        assert first_values(live)[key] == "200"
        assert math.isnan(*client.parameters(NODE, "baseline_coulomb_friction"))
        assert client.set_together(NODE, {"warn_ratio": 1.3}).successful
        assert client.status_values()[key] == "200"
        assert client.set_together(NODE, {"baseline_coulomb_friction": math.nan}).successful
        client.next_status(lambda status: key not in values_of(status), "no baseline")


def test_retention(live, history):
    for day in (4000, 1):
        history.add(success(START - day * DAY))
    live.start_identifier({"history_days": 3000.0})
    live.client.trigger("identify")
    kept = [entry.time for entry in history.entries()]
    assert START - DAY in kept
    assert START - 4000 * DAY not in kept


def test_a_history_that_cannot_be_written(live, tmp_path):
    """The node warns and goes on; once it can be written, nothing is missing."""
    blocked = tmp_path / "blocked"
    blocked.touch()
    history = HistoryFile(blocked / "history.sqlite")
    node = live.start_identifier({"history_file": history.path})
    client = live.client
    cause = (
        f"the history is not being written: {history.path}: its folder is a file: check the folder"
    )
    status = client.next_status()
    assert status.level == WARN
    assert status.message.startswith(cause)
    assert values_of(status)["NE 107"] == "M"
    client.identified(RECORD)
    assert client.last_values()["estimate_valid"] == "true"
    assert f"lost when this node stops: {cause}" in client.success("set_baseline")
    assert len(logged(live, node, f"]: {cause}")) == 1

    blocked.unlink()
    assert client.trigger("identify").success
    status = client.next_status(lambda one: cause not in one.message, "the end of the warning")
    assert status.level == OK
    entries = history.entries()
    assert len(entries) >= 2
    assert entries[-2].friction == entries[-1].friction == EXPECTED
    assert history.baseline(VALVE.name).baseline.coulomb_friction == EXPECTED.value


def fill(history, drift, method):
    """Twenty weeks up to the start, and before them an estimate that differs."""
    baseline = Baseline(141.0, 1.0)
    history.add(success(START - 365 * DAY, 900.0, method=method))
    begin = START - 20 * 7 * DAY
    history.set_baseline(VALVE, KeptBaseline(baseline, begin + 1, begin))
    for week in range(20):
        day = 7 * week
        friction = 150.0 + drift * day * DAY / MONTH
        history.add(success(begin + day * DAY, friction, 1.0, baseline=baseline, method=method))


def test_a_drift_is_told_until_a_baseline_is_set(live, history):
    fill(history, 3.0, "plant")
    live.start_identifier()
    values = live.client.status_values()
    assert float(values["friction_drift [N/month]"]) == pytest.approx(3.0)
    assert 0 < float(values["friction_drift half width [N/month]"]) < 1
    assert values["limit_expected"] == "warn_ratio"
    dates = [values[f"limit_expected {which}[date]"] for which in ("earliest ", "", "latest ")]
    assert dates == sorted(dates)
    assert dates[1].startswith("2027-01-2")  # 8.75 months after 2026-05-04
    live.client.set_baseline(RECORD)
    values = live.client.status_values()
    assert not [key for key in values if "drift" in key]
    assert math.isclose(float(values["friction_ratio"]), 1.0)


def test_a_drift_is_that_of_the_method_which_the_settings_call_for(live, history):
    fill(history, 3.0, "refined")
    live.start_identifier()
    assert not [key for key in live.client.status_values() if "drift" in key]
    assert live.client.set_together(NODE, {"method": "bench"}).successful
    live.client.trigger("identify")
    values = live.client.status_values(lambda one: "friction_drift" in str(one), "a drift")
    assert float(values["friction_drift [N/month]"]) == pytest.approx(3.0)


def test_only_a_significant_drift_has_keys():
    scattered = [150.0, 154.0, 151.0, 156.0, 153.0]
    points = [DatedNumber(START + k * DAY, one, 0.1) for k, one in enumerate(scattered)]
    assert trend_values(trend_of(points, Baseline(141.0))) == {}
    assert trend_values(None) == {}
    rising = [one._replace(value=150.0 + k) for k, one in enumerate(points)]
    keys = {"friction_drift [N/month]", "friction_drift half width [N/month]", "friction_drift of"}
    assert set(trend_values(trend_of(rising))) == keys


NAME = "VALVE_FRICTION_HISTORY_URL"


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
    client.set_baseline(RECORD)
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
        node = live.start_identifier({"history_url": database.url})
        values = live.client.status_values(what="the first diagnostic")
        assert str(database) in values["history_server not taken"]
        assert f"at its next start: {values['history_server not taken']}" in node.errors
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
