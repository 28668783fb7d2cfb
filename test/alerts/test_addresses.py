"""Addresses of webhooks, what they refuse, and the signature."""

import hashlib
import hmac
import json
from datetime import datetime, timedelta, timezone

import pytest

from valve_friction_ros.alerts import Alert, Secrets, Webhook, signature
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
        ("example.com/s3cret", "is no address"),
        ("ftp://example.com/s3cret", "is no address"),
        ("https:///s3cret", "is no address"),
        ("https://example.com:port/s3cret", "is no address"),
        ("https://example.com:99999/s3cret", "is no address"),
        ("https://[::1/s3cret", "is no address"),
        ("http://example.com/s3cret", "http to another machine"),
        ("http://127.0.0.1.example.com/s3cret", "http to another machine"),
        ("http://10.0.0.1/s3cret", "http to another machine"),
        ("https://user:s3cret@example.com/", "VALVE_FRICTION_WEBHOOK_TOKEN"),
        ("https://s3cret@example.com/", "VALVE_FRICTION_WEBHOOK_TOKEN"),
        ("https://example.com/s3cret\r\nX: y", "a space, or a character that is not ASCII"),
        ("https://example.com/s3cret x", "a space, or a character that is not ASCII"),
        ("https://exämple.com/s3cret", "a space, or a character that is not ASCII"),
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
    with pytest.raises(ValueError, match=f"^{name} is http to another machine") as refused:
        Webhook.from_environment({name: "http://example.com/s3cret"})
    assert "s3cret" not in str(refused.value)
