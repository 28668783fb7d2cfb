# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Addresses of webhooks, what they refuse, and the signature."""

import contextlib
import hashlib
import hmac
import json
import socket
import threading
import time
from datetime import datetime, timedelta, timezone
from functools import partial

import processes
import pytest
from webhook_server import (
    Receiver,
    answer_for_ever,
    answer_never,
    answer_slowly,
    answer_with,
    headers_for_ever,
    no_http,
    self_signed,
)

from valve_friction_ros.alerts import (
    SIGNATURE,
    Alert,
    AlertSender,
    DeliveryError,
    Secrets,
    Webhook,
    post,
    signature,
)
from valve_friction_ros.health import Level


@pytest.mark.parametrize(
    ("url", "shown", "target"),
    [
        ("https://example.com", "https://example.com:443", "/"),
        ("https://example.com:8443/a/b?key=1#x", "https://example.com:8443", "/a/b?key=1"),
        ("HTTPS://EXAMPLE.com/Path", "https://example.com:443", "/Path"),
        ("http://localhost:80/x", "http://localhost:80", "/x"),
        ("http://127.1.2.3:9/x", "http://127.1.2.3:9", "/x"),
        ("http://[::1]:9/x", "http://[::1]:9", "/x"),
    ],
)
def test_an_address(url, shown, target):
    webhook = Webhook.at(url)
    assert str(webhook) == shown
    assert webhook.target == target
    assert "key" not in repr(webhook)


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("example.com/s3cret", "is not an address"),
        ("ftp://example.com/s3cret", "is not an address"),
        ("https:///s3cret", "is not an address"),
        ("https://example.com:port/s3cret", "is not an address"),
        ("https://example.com:99999/s3cret", "is not an address"),
        ("https://[::1/s3cret", "is not an address"),
        ("http://example.com/s3cret", "http to another machine"),
        ("http://127.0.0.1.example.com/s3cret", "http to another machine"),
        ("http://10.0.0.1/s3cret", "http to another machine"),
        ("https://user:s3cret@example.com/", "VALVE_FRICTION_WEBHOOK_TOKEN"),
        ("https://s3cret@example.com/", "VALVE_FRICTION_WEBHOOK_TOKEN"),
        ("https://example.com/s3cret\r\nX: y", "a space or a non-ASCII character"),
        ("https://example.com/s3cret x", "a space or a non-ASCII character"),
        ("https://exämple.com/s3cret", "a space or a non-ASCII character"),
    ],
)
def test_what_is_no_address_is_refused_without_repeating_it(url, words):
    with pytest.raises(ValueError, match=words) as refused:
        Webhook.at(url)
    assert "s3cret" not in str(refused.value)


def test_the_signature_is_that_of_the_definition():
    expected = hmac.new(b"key", b'1700000000.{"a":1}', hashlib.sha256).hexdigest()
    assert signature("key", b'{"a":1}', 1_700_000_000) == f"t=1700000000,v1={expected}"


def test_secrets_come_from_the_environment_and_are_never_shown():
    names = ("VALVE_FRICTION_WEBHOOK_SECRET", "VALVE_FRICTION_WEBHOOK_TOKEN")
    secrets = Secrets.from_environment(dict(zip(names, ("key", "token\n"), strict=True)))
    assert secrets == Secrets("key", "token")
    assert "key" not in repr(secrets)
    assert "token" not in repr(secrets).replace("token=", "")
    assert secrets.headers(b"", 0)["Authorization"] == "Bearer token"
    assert Secrets.from_environment({}).headers(b"", 0) == {}
    for wrong in ("to\r\nken", "tök", "to ken"):
        with pytest.raises(ValueError, match="VALVE_FRICTION_WEBHOOK_TOKEN") as refused:
            Secrets.from_environment({names[1]: wrong})
        assert wrong not in str(refused.value)


@pytest.mark.parametrize(
    ("beside", "token"),
    [
        ("https://example.com/a", "t0ken"),
        ("https://example.com:443/a", "t0ken"),
        ("https://example.com/b", ""),
        ("https://example.com:8443/a", ""),
        ("https://example.org/a", ""),
        ("http://example.com/a", ""),  # cannot be used
        ("", ""),
    ],
)
def test_the_token_is_for_the_address_beside_it(beside, token):
    """The signature does not give its key away."""
    environment = {"VALVE_FRICTION_WEBHOOK_URL": beside}
    given = Webhook.at("https://example.com/a")
    assert Secrets("k3y", "t0ken").going_to(given, environment) == Secrets("k3y", token)


def test_an_alert_as_json():
    time = datetime(2026, 1, 2, 5, 4, 5, tzinfo=timezone(timedelta(hours=2)))
    alert = Alert("FV-101", "/fv/identifier", Level.OK, Level.ERROR, "F", "excess µ", 2.5, time)
    assert json.loads(alert.body()) == {
        "event_id": alert.event_id,
        "time": "2026-01-02T03:04:05.000+00:00",
        "valve": "FV-101",
        "node": "/fv/identifier",
        "old_level": "OK",
        "new_level": "ERROR",
        "ne_107": "F",
        "message": "excess µ",
        "friction_ratio": 2.5,
        "alarms": {},
    }
    other = Alert("FV-101", "/fv/identifier", Level.OK, Level.ERROR, "F", "excess µ", float("nan"))
    assert other.event_id != alert.event_id
    assert json.loads(other.body())["friction_ratio"] is None


def test_an_address_of_the_environment():
    name = "VALVE_FRICTION_WEBHOOK_URL"
    assert Webhook.from_environment({}) is None
    found = Webhook.from_environment({name: " https://example.com/s3cret "})
    assert found == Webhook.at("https://example.com/s3cret")
    assert "s3cret" not in str(found) + repr(found)
    with pytest.raises(ValueError, match=f"^{name} uses http to another machine") as refused:
        Webhook.from_environment({name: "http://example.com/s3cret"})
    assert "s3cret" not in str(refused.value)


SECRETS = Secrets("key", "t0ken")
LIMIT = 0.5
PATIENCE = 20.0


@pytest.fixture(autouse=True)
def no_proxies(monkeypatch):
    for name in ("https_proxy", "HTTPS_PROXY", "all_proxy", "no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    return self_signed(tmp_path_factory.mktemp("certificate"))


@pytest.fixture
def sender():
    made = AlertSender(SECRETS, waits=[0.01] * 3, limit=LIMIT)
    yield made
    made.close()


def outbox_to(sender, url):
    return sender.outbox(Webhook.at(url))


def alert(message="", new=Level.WARN):
    return Alert("FV-101", "/fv_101/identifier", Level.OK, new, "M", message)


wait_until = partial(processes.wait_until, patience=PATIENCE)


def failure(url, limit=LIMIT):
    with pytest.raises(DeliveryError) as failed:
        post(Webhook.at(url), b"{}", SECRETS, limit)
    assert "hook" not in str(failed.value)
    assert "t0ken" not in str(failed.value)
    return failed.value


def test_an_alert_arrives_once_and_signed(sender):
    with Receiver() as receiver:
        outbox, sent = outbox_to(sender, receiver.url), alert()
        outbox.put(sent)
        wait_until(lambda: outbox.state().delivered)
        ((path, headers, body),) = receiver.requests
    assert path == "/hook?valve=1"
    assert body == sent.body()
    time_of_signature = int(headers[SIGNATURE].split(",")[0].removeprefix("t="))
    assert headers[SIGNATURE] == signature("key", body, time_of_signature)
    assert abs(time_of_signature - time.time()) < PATIENCE
    assert headers["Authorization"] == "Bearer t0ken"
    assert headers["Content-Type"] == "application/json"
    assert outbox.state()[:5] == (0, 1, 0, None, None)


def test_only_a_trusted_certificate_of_the_host_gets_an_alert(certificate, monkeypatch):
    with Receiver(certificate) as receiver:
        error = failure(receiver.url, PATIENCE)
        assert error.is_final
        assert "SSL_CERT_FILE" in str(error)
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate.with_name("certificate.pem")))
        error = failure(receiver.url.replace("localhost", "127.0.0.1"), PATIENCE)
        assert error.is_final
        assert "is not trusted" in str(error)
        assert receiver.requests == []
        post(Webhook.at(receiver.url), b"{}", SECRETS)
        assert len(receiver.requests) == 1


@pytest.mark.parametrize("answer", [answer_never, answer_slowly, headers_for_ever, no_http])
def test_an_answer_that_does_not_end_in_time_or_is_none(answer):
    with Receiver(answer=answer) as receiver:
        begun = time.monotonic()
        error = failure(receiver.url)
        assert time.monotonic() - begun < PATIENCE
    assert not error.is_final
    assert any(words in str(error) for words in ("within 0.5 s", "did not answer with HTTP"))


def test_a_handshake_that_does_not_end_in_time():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        error = failure(f"https://localhost:{silent.getsockname()[1]}/hook")
    assert "did not answer within 0.5 s" in str(error)


def test_gigabytes_are_not_read():
    with Receiver(answer=answer_for_ever) as receiver:
        begun = time.monotonic()
        post(Webhook.at(receiver.url), b"{}", SECRETS, PATIENCE)
        assert time.monotonic() - begun < PATIENCE / 2


@pytest.mark.parametrize(
    ("status", "is_final"), [(500, False), (503, False), (429, False), (404, True), (401, True)]
)
def test_refusals(status, is_final):
    with Receiver(answer=answer_with(status)) as receiver:
        error = failure(receiver.url)
    assert str(error).endswith(f"answered {status}")
    assert error.is_final == is_final


def test_a_redirect_is_not_followed():
    with Receiver() as other, Receiver(answer=answer_with(307, Location=other.url)) as receiver:
        error = failure(receiver.url)
        assert len(receiver.requests) == 1
        assert other.requests == []
    assert error.is_final
    assert "redirects are not followed" in str(error)


def test_a_proxy_of_the_environment_serves_other_machines_only(monkeypatch):
    asked = []
    with socket.create_server(("127.0.0.1", 0)) as proxy, Receiver() as receiver:
        port = proxy.getsockname()[1]
        monkeypatch.setenv("https_proxy", f"http://me:pa%40ss@127.0.0.1:{port}")

        def serve():
            connection, _ = proxy.accept()
            with connection:
                asked.append(connection.recv(65536))
                connection.sendall(b"HTTP/1.0 403 Forbidden\r\n\r\n")

        thread = threading.Thread(target=serve)
        thread.start()
        error = failure("https://example.invalid/hook", PATIENCE)
        thread.join()
        post(Webhook.at(receiver.url), b"{}", SECRETS, PATIENCE)
    assert b"CONNECT example.invalid:443" in asked[0]
    assert b"Basic bWU6cGFAc3M=" in asked[0]
    assert b"t0ken" not in asked[0]
    assert "pa" not in str(error).replace("example.invalid", "")


def test_what_a_server_misses_it_gets_when_it_is_back():
    with Receiver() as first:
        port = first.port
    sender = AlertSender(SECRETS, waits=[0.05] * 2000, limit=LIMIT)
    outbox = outbox_to(sender, f"http://127.0.0.1:{port}/hook")
    one, two = alert("one"), alert("two", Level.ERROR)
    outbox.put(one)
    outbox.put(two)
    wait_until(lambda: outbox.state().problem)
    assert "refused" in outbox.state().problem
    with Receiver(port=port, answer=answer_with(500)) as back:
        wait_until(lambda: len(back.requests) > 2)
        assert {body["event_id"] for body in back.bodies} == {one.event_id}
        tried = len(back.requests)
        back.answer = answer_with(200)
        wait_until(lambda: outbox.state().delivered == 2)
        ids = [body["event_id"] for body in back.bodies]
    assert ids[-1] == two.event_id
    assert ids.count(two.event_id) == 1
    assert ids[:-1].count(one.event_id) == len(ids) - 1 >= tried
    assert outbox.state()[:5] == (0, 2, 0, None, None)
    sender.close()


def test_tries_are_bounded_and_the_loss_is_told(sender):
    with Receiver(answer=answer_with(500)) as receiver:
        outbox = outbox_to(sender, receiver.url)
        outbox.put(alert())
        wait_until(lambda: outbox.state().given_up)
        assert len(receiver.requests) == 4
        state = outbox.state()
        assert state.waiting == 0
        assert "the alert OK → WARN of 2" in state.lost
        assert "answered 500" in state.lost
        receiver.answer = answer_with(200)
        outbox.put(alert())
        wait_until(lambda: outbox.state().delivered)
        assert outbox.state()[:5] == (0, 1, 1, None, None)


def test_the_queue_is_bounded_and_keeps_the_newest():
    with Receiver(answer=answer_never) as receiver:
        sender = AlertSender(SECRETS, limit=PATIENCE)
        outbox = outbox_to(sender, receiver.url)
        alerts = [alert(str(number)) for number in range(150)]
        outbox.put(alerts[0])
        wait_until(lambda: receiver.requests)
        begun = time.monotonic()
        for one in alerts[1:]:
            outbox.put(one)
        assert time.monotonic() - begun < 1.0
        state = outbox.state()
        assert (state.waiting, state.given_up) == (100, 50)
        assert "more than 100 alerts are waiting" in state.lost
        sender.close()


def test_many_slow_hosts_hold_up_no_other_valve():
    """One after the other, each would cost the last valve a whole try."""
    hosts, limit = 6, 100 * PATIENCE
    sender = AlertSender(SECRETS, waits=[3600.0], limit=limit)
    with contextlib.ExitStack() as stack:
        silent = [stack.enter_context(Receiver(answer=answer_never)) for _ in range(hosts)]
        receiver = stack.enter_context(Receiver())
        slow = [outbox_to(sender, host.url) for host in silent]
        for outbox in slow:
            outbox.put(alert())
        wait_until(lambda: all(host.requests for host in silent))
        quick = outbox_to(sender, receiver.url)
        for delivered in (1, 2):
            quick.put(alert())
            wait_until(lambda wanted=delivered: quick.state().delivered == wanted)
        assert [one.state().waiting for one in slow] == [1] * hosts
        sender.close()


def test_a_silent_host_of_many_valves_takes_one_try_a_round():
    """At a try for each, 30 valves would hold up the last one by 15 s."""
    sender = AlertSender(SECRETS, waits=[3600.0], limit=LIMIT)
    with Receiver(answer=answer_never) as dead, Receiver() as receiver:
        silent = [outbox_to(sender, f"{dead.url}/{number}") for number in range(30)]
        for outbox in silent:
            outbox.put(alert())
        alive = outbox_to(sender, receiver.url)
        begun = time.monotonic()
        alive.put(alert())
        wait_until(lambda: alive.state().delivered == 1)
        assert time.monotonic() - begun < 10 * LIMIT
        wait_until(lambda: all(one.state().problem for one in silent))
        assert len(dead.requests) == 1
    assert {one.state().waiting for one in silent} == {1}
    sender.close()


def test_one_slow_path_of_a_host_starves_no_other():
    def answer(handler):
        (answer_never if "slow" in handler.path else answer_with(200))(handler)

    sender = AlertSender(SECRETS, waits=[0.01] * 5, limit=LIMIT)
    with Receiver(answer=answer) as receiver:
        slow, quick = (outbox_to(sender, f"{receiver.url}/{path}") for path in ("slow", "quick"))
        for outbox in (slow, quick):
            outbox.put(alert())
        wait_until(lambda: slow.state().given_up == 1)
        assert quick.state()[:3] == (0, 1, 0)
    sender.close()


def test_valves_with_one_host_share_a_thread_that_begins_with_the_first_alert():
    def threads():
        return {one for one in threading.enumerate() if one.name == "alerts" and one.is_alive()}

    before = threads()
    sender = AlertSender(SECRETS)
    with Receiver() as receiver:
        outboxes = [outbox_to(sender, receiver.url) for _ in range(5)]
        assert threads() <= before
        for outbox in outboxes:
            outbox.put(alert())
        assert len(threads() - before) == 1
        wait_until(lambda: all(outbox.state().delivered == 1 for outbox in outboxes))
    sender.close()
    wait_until(lambda: not threads() - before)
