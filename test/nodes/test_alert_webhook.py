# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alerts of an identifier over DDS: one a change, while a receiver is away or misbehaves."""

import time

import pytest
from live_nodes import ERROR, NODE, OK, WARN, values_of
from records import quick_record
from webhook_server import Receiver, answer_never, answer_with, self_signed

from valve_friction_ros.alerts import SIGNATURE, signature
from valve_friction_ros.health import Baseline, Level
from valve_friction_ros.history import KeptValve, keep_usage, read_told_level
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.usage import BINS, Usage, UsedDay

HEALTHY, TIGHT = quick_record(), quick_record(HIGH_FRICTION)
KNOWN = {"baseline_coulomb_friction": Baseline.of(identify(HEALTHY, BENCH_VALVE)).coulomb_friction}
SECRETS = {"VALVE_FRICTION_WEBHOOK_SECRET": "k3y", "VALVE_FRICTION_WEBHOOK_TOKEN": "t0ken"}


@pytest.fixture(autouse=True)
def secrets(monkeypatch):
    for name, value in SECRETS.items():
        monkeypatch.setenv(name, value)


def posting_to(receiver):
    return {**KNOWN, "webhook_url": receiver.url, "webhook_period": 0.0}


def changes(receiver):
    return [(body["old_level"], body["new_level"]) for body in receiver.bodies]


def require_no_secret(live, node):
    shown = node.errors + node.output + "".join(map(str, live.client.statuses))
    assert not any(secret in shown for secret in SECRETS.values())


def test_each_change_of_level_is_posted_once(live, tmp_path, monkeypatch):
    certificate = self_signed(tmp_path)
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate.with_name("certificate.pem")))
    with Receiver(certificate) as receiver:
        monkeypatch.setenv("VALVE_FRICTION_WEBHOOK_URL", receiver.url)
        node = live.start_identifier({**KNOWN, "webhook_period": 0.0, "valve_tag": "FV-101"})
        client = live.client
        client.identified(TIGHT)
        client.next_status(lambda one: one.level == ERROR, "an alarm")
        client.wait_until(lambda: len(receiver.requests) == 1, "an alert")
        client.identified(TIGHT)  # no change
        client.identified(HEALTHY)
        client.wait_until(lambda: len(receiver.requests) == 2, "another alert")
        values = client.status_values(
            lambda one: values_of(one)["webhook delivered"] == "2", "both delivered"
        )
        node.stop()
        client.watched.clear()
        assert changes(receiver) == [("OK", "ERROR"), ("ERROR", "OK")]
        first, second = receiver.bodies
        assert first["event_id"] != second["event_id"]
        assert (first["valve"], first["node"], first["ne_107"]) == ("FV-101", NODE, "F")
        assert first["message"].startswith("excess friction")
        assert first["friction_ratio"] > 2
        for _, headers, body in receiver.requests:
            stamp = int(headers[SIGNATURE].split(",")[0].removeprefix("t="))
            assert headers[SIGNATURE] == signature("k3y", body, stamp)
            assert headers["Authorization"] == "Bearer t0ken"
    assert values["webhook"] == f"https://localhost:{receiver.port}"
    assert (values["webhook waiting"], values["webhook given up"]) == ("0", "0")
    require_no_secret(live, node)


def test_a_refused_alert_is_upkeep_and_no_alert(live):
    with Receiver(answer=answer_with(404)) as receiver:
        node = live.start_identifier(posting_to(receiver))
        client = live.client
        client.identified(TIGHT)
        client.wait_until(lambda: len(receiver.requests) == 1, "an alert")
        client.identified(HEALTHY)
        client.wait_until(lambda: len(receiver.requests) == 2, "another alert")
        status = client.next_status(
            lambda one: values_of(one)["webhook given up"] == "2", "alerts given up"
        )
        assert status.level == WARN
        assert values_of(status)["NE 107"] == "M"
        assert "the alert ERROR → OK of 2" in status.message
        assert f"http://127.0.0.1:{receiver.port} answered 404" in status.message
        client.next_status()  # the WARN of the webhook itself is not posted
        client.next_status()
        assert changes(receiver) == [("OK", "ERROR"), ("ERROR", "OK")]
    assert "/hook" not in node.errors
    require_no_secret(live, node)


def test_a_receiver_that_hangs_holds_up_neither_diagnostics_nor_the_end(live):
    with Receiver(answer=answer_never) as receiver:
        node = live.start_identifier({**KNOWN, "webhook_url": receiver.url})
        client = live.client
        client.identified(TIGHT)
        client.wait_until(lambda: receiver.requests, "an alert under way")
        begun = time.monotonic()
        for _ in range(3):
            client.next_status()
        assert time.monotonic() - begun < 6.0
        client.watched.clear()
        begun = time.monotonic()
        node.stop()
        assert time.monotonic() - begun < 3.0


def test_a_flapping_valve_posts_one_change_a_period(live):
    with Receiver() as receiver:
        client = live.client_of_identifier(
            {**KNOWN, "webhook_url": receiver.url, "webhook_period": 3600.0}
        )
        for record, level in ((TIGHT, ERROR), (HEALTHY, OK)) * 2:
            client.identified(record)
            client.next_status(lambda one, level=level: one.level == level, "the level")
        assert changes(receiver) == [("OK", "ERROR")]
        assert client.set_together(NODE, {"webhook_period": 0.0}).successful
        client.wait_until(lambda: len(receiver.requests) == 2, "the newest level")
        assert changes(receiver)[1] == ("ERROR", "OK")


def test_silence_of_the_inputs_is_posted(live):
    with Receiver() as receiver:
        live.start_identifier(posting_to(receiver))
        live.client.identified(HEALTHY)
        assert live.client.set_together(NODE, {"input_timeout": 0.5}).successful
        live.client.wait_until(lambda: receiver.requests, "silence")
        assert changes(receiver) == [("OK", "WARN")]
        assert "no data on" in receiver.bodies[0]["message"]


def test_the_token_goes_only_to_the_address_beside_it(live, monkeypatch):
    with Receiver() as receiver, Receiver() as other:
        monkeypatch.setenv("VALVE_FRICTION_WEBHOOK_URL", receiver.url)
        node = live.start_identifier({**KNOWN, "webhook_url": other.url, "webhook_period": 0.0})
        live.client.identified(TIGHT)
        live.client.wait_until(lambda: other.requests, "an alert")
        headers = other.requests[0][1]
        assert "Authorization" not in headers
        assert SIGNATURE in headers
        assert receiver.requests == []
        told = (
            f"no token is sent to http://127.0.0.1:{other.port}, because the token in the "
            "environment goes"
        )
        assert told in node.errors
    require_no_secret(live, node)


@pytest.mark.slow
def test_what_is_found_on_a_valve_is_told_once_whatever_restarts(live, history):
    """A packing whose life is over, known from the history at each start; no level of friction."""
    used = UsedDay(20_000, 0, Usage(1.0, 50, 2, (10**9, *[0] * (BINS - 1))))
    history.path.parent.mkdir(parents=True, exist_ok=True)
    keep_usage(history, KeptValve(NODE, "FV-101"), "run", [used])
    with Receiver() as receiver:
        chosen = posting_to(receiver)
        client = live.client
        for _ in range(2):
            node = live.start_identifier({**chosen, "reversal_limit": 20.0})
            assert client.next_status().level == WARN
            client.wait_until(lambda: read_told_level(history, NODE) == Level.WARN, "the level")
            client.next_status()
            live.kill(node)
        live.start_identifier({**chosen, "reversal_limit": 20.0})
        assert client.next_status().level == WARN  # and the client has met the new node
        client.next_status()
        assert client.set_together(NODE, {"baseline_in_alarm": True}).successful
        client.set_baseline(HEALTHY)
        assert receiver.requests == []
        assert history.baseline(NODE).level == Level.WARN
        for limit, count in ((0.0, 1), (20.0, 2)):
            assert client.set_together(NODE, {"reversal_limit": limit}).successful
            client.wait_until(lambda count=count: len(receiver.requests) == count, "an alert")
        assert changes(receiver) == [("WARN", "OK"), ("OK", "WARN")]
        healthy, old = receiver.bodies
    assert healthy["friction_ratio"] == pytest.approx(1.0, abs=0.1)
    assert old["friction_ratio"] is None


@pytest.mark.slow
def test_what_waited_at_a_kill_is_told_after_the_restart(live, history):
    with Receiver() as first:
        url, port = first.url, first.port
    chosen = {**KNOWN, "webhook_url": url, "webhook_period": 0.0}
    node = live.start_identifier(chosen)
    client = live.client
    client.identified(TIGHT)
    status = client.next_status(
        lambda one: "refused" in values_of(one)["webhook problem"], "a problem"
    )
    assert status.level == ERROR
    assert values_of(status)["webhook waiting"] == "1"
    live.kill(node)
    with Receiver(port=port) as back:
        node = live.start_identifier(chosen)
        client.wait_until(lambda: back.requests, "the alert that waited")
        client.wait_until(lambda: read_told_level(history, NODE) == Level.ERROR, "the told level")
        live.restart(chosen)
        client.next_status()
        client.next_status()
        assert changes(back) == [("OK", "ERROR")]


def test_one_digest_a_day_lists_the_alarms(live):
    with Receiver() as receiver:
        client = live.client_of_identifier(posting_to(receiver))
        client.identified(TIGHT)
        client.wait_until(lambda: len(receiver.requests) == 1, "an alert")
        soon = (time.time() + 5.0) % 86_400 / 3600
        assert client.set_together(NODE, {"webhook_digest": soon}).successful
        client.wait_until(lambda: len(receiver.requests) == 2, "the digest")
        client.next_status(lambda one: values_of(one)["webhook delivered"] == "2", "both delivered")
        client.next_status()
        digest = receiver.bodies[1]
        assert len(receiver.requests) == 2
        assert digest["digest"]["valves"] == digest["digest"]["unanswered"] == 1
        (alarm,) = digest["alarms"]
        told = alarm["node"], alarm["alarm"], alarm["state"], alarm["level"]
        assert told == (NODE, "friction_high", "unacknowledged", "ERROR")
