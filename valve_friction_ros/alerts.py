# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alerts: changes of the level of a valve, posted to a webhook; no ROS.

An `AlertSender` holds the queues of all valves of a process and the threads that send them. Each
attempt is bounded in time and memory, whatever the receiver does.
"""

import base64
import contextlib
import hashlib
import hmac
import http.client
import json
import math
import os
import socket
import ssl
import threading
import time
import uuid
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import partial
from itertools import accumulate, repeat
from typing import NamedTuple, Protocol
from urllib.parse import SplitResult, unquote, urlsplit
from urllib.request import getproxies, proxy_bypass

from valve_friction_ros.health.levels import Level
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.outside_text import is_loopback


class Letter(Protocol):
    """A message to post: a change of level, or one without a level."""

    @property
    def new_level(self) -> Level | None:
        """The level that it reports, if any."""

    @property
    def title(self) -> str:
        """Name of the letter in a report of its failed delivery."""

    def body(self) -> bytes:
        """Return the letter as JSON."""


@equal_by_fields
@dataclass(frozen=True)
class Alert:
    """A change of the level of a valve.

    Attributes
    ----------
    valve : str
        Tag of the valve.
    node : str
        Name of its identifier, fully qualified.
    old_level, new_level : Level
        The level reported last, and the present one.
    ne_107 : str
        NE 107 status signal; empty: good.
    message : str
        The message of the diagnosis.
    friction_ratio : float or None
        Friction over its baseline; None or nan where unknown.
    time : datetime
        Time of the change by the system clock, UTC.
    event_id : str
        Identical in all attempts, so that a receiver can discard duplicates.
    alarms : mapping of str to str
        States of the alarms that are not normal, by name.
    """

    valve: str
    node: str
    old_level: Level
    new_level: Level
    ne_107: str
    message: str
    friction_ratio: float | None = None
    time: datetime = field(default_factory=lambda: datetime.now(timezone.utc))
    event_id: str = field(default_factory=lambda: uuid.uuid4().hex)
    alarms: Mapping[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The change and its time."""
        change = f"{self.old_level.name} → {self.new_level.name}"
        return f"the alert {change} of {self.time:%Y-%m-%d %H:%M:%S} UTC"

    def body(self) -> bytes:
        """Return the alert as JSON: the attributes by name, the time in ISO 8601."""
        ratio = self.friction_ratio
        content = {
            "event_id": self.event_id,
            "time": self.time.astimezone(timezone.utc).isoformat(timespec="milliseconds"),
            "valve": self.valve,
            "node": self.node,
            "old_level": self.old_level.name,
            "new_level": self.new_level.name,
            "ne_107": self.ne_107,
            "message": self.message,
            "friction_ratio": None if ratio is None or not math.isfinite(ratio) else ratio,
            "alarms": dict(self.alarms),
        }
        return json.dumps(content, ensure_ascii=False).encode()


SIGNATURE = "X-Valve-Friction-Signature"
"""Header that carries the signature."""

URL_VARIABLE = "VALVE_FRICTION_WEBHOOK_URL"
"""Environment variable with the address that the token belongs to."""
_SECRET = "VALVE_FRICTION_WEBHOOK_SECRET"  # noqa: S105 - the name of a variable
_TOKEN = "VALVE_FRICTION_WEBHOOK_TOKEN"  # noqa: S105

Place = tuple[str, str, int]
"""Scheme, host and port."""

_PORTS = {"https": 443, "http": 80}


@dataclass(frozen=True)
class Webhook:
    """The address of a webhook.

    Its text leaves out path and query, because many services put secrets there.

    Attributes
    ----------
    scheme : str
        ``https``, or ``http`` to this machine.
    host : str
        Host name or address.
    port : int
        TCP port.
    target : str
        Path and query.
    """

    scheme: str
    host: str
    port: int
    target: str = field(repr=False)

    @classmethod
    def at(cls, url: str, name: str = "webhook_url") -> "Webhook":
        """Parse the address of a webhook; `name` names it in errors.

        Raises ValueError if `url` is not an address, is not encrypted although it leads to another
        machine, or holds a user name or a password. The error does not quote the address.
        """
        if not url.isascii() or not url.isprintable() or " " in url:
            raise ValueError(f"{name} contains a space or a non-ASCII character: encode it")
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError:
            host = port = None
        if not host or parts.scheme not in _PORTS:
            raise ValueError(f"{name} is not an address: write https://host/path")
        if parts.username is not None or parts.password is not None:
            raise ValueError(
                f"{name} contains a name or a password, which everyone on the ROS graph can read: "
                f"put a token into the environment variable {_TOKEN}"
            )
        if parts.scheme == "http" and not is_loopback(host):
            raise ValueError(
                f"{name} uses http to another machine, where anyone in between can read and change "
                "it: use https, or a relay on this machine"
            )
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        return cls(parts.scheme, host, _PORTS[parts.scheme] if port is None else port, target)

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Webhook | None":
        """Parse ``VALVE_FRICTION_WEBHOOK_URL`` if it is set; raises ValueError like `at`."""
        url = environment.get(URL_VARIABLE, "").strip()
        return cls.at(url, URL_VARIABLE) if url else None

    @property
    def place(self) -> Place:
        """Scheme, host and port."""
        return self.scheme, self.host, self.port

    def __str__(self) -> str:
        """Return scheme, host and port."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


@dataclass(frozen=True)
class Secrets:
    """Credentials that authenticate an alert to its receiver; never shown.

    Attributes
    ----------
    secret : str
        Key of the signature; empty: no signature.
    token : str
        Bearer token, only for the address in the environment; empty: none.
    """

    secret: str = field(default="", repr=False)
    token: str = field(default="", repr=False)

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Secrets":
        """Read ``VALVE_FRICTION_WEBHOOK_SECRET`` and ``VALVE_FRICTION_WEBHOOK_TOKEN``.

        Raises ValueError if the token is not valid in a header; the error does not quote it.
        """
        secret, token = (environment.get(name, "").strip() for name in (_SECRET, _TOKEN))
        if not token.isascii() or (token and not token.isprintable()) or " " in token:
            raise ValueError(f"{_TOKEN} contains a space or a non-ASCII character: correct it")
        return cls(secret, token)

    def going_to(self, webhook: Webhook, environment: Mapping[str, str] = os.environ) -> "Secrets":
        """Return the credentials for a webhook: the token only for the address in the environment.

        A person who may set a parameter need not be entitled to the token. The key of the signature
        is never sent.
        """
        with contextlib.suppress(ValueError):
            if webhook == Webhook.from_environment(environment):
                return self
        return Secrets(self.secret)

    def headers(self, body: bytes, time: int) -> dict[str, str]:
        """Return the headers that authenticate a body sent at `time`, s since 1970."""
        headers = {}
        if self.secret:
            headers[SIGNATURE] = signature(self.secret, body, time)
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        return headers


def signature(secret: str, body: bytes, time: int) -> str:
    """Sign a body that is sent at `time`, s since 1970 (UTC).

    The signature is ``t=time,v1=digest``. The digest is the HMAC-SHA256 of the time, a full stop
    and the body, in hexadecimal. A receiver computes the same digest, compares in constant time,
    and refuses old times.
    """
    signed = f"{time}.".encode() + body
    return f"t={time},v1={hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()}"


_RETRIED = frozenset({408, 425, 429})
"""Status codes besides 5xx after which a retry may succeed: timeout, too early, too many."""


class DeliveryError(Exception):
    """A failed delivery; the message gives the cause and holds no secret.

    Attributes
    ----------
    is_final : bool
        Whether a retry is useless until somebody changes the configuration.
    is_answered : bool
        Whether the host has answered; if not, the next letter to it would fail too.
    """

    def __init__(self, cause: str, is_final: bool = False, is_answered: bool = True) -> None:
        super().__init__(cause)
        self.is_final = is_final
        self.is_answered = is_answered


class _Connection(http.client.HTTPConnection):
    """A connection with a limit on its total time, including the time to connect."""

    def __init__(self, webhook: Webhook, limit: float) -> None:
        proxy = None if is_loopback(webhook.host) else _proxy(webhook.host)
        if proxy is None:
            super().__init__(webhook.host, webhook.port, timeout=limit)
        else:
            super().__init__(proxy.hostname or "", proxy.port or 80, timeout=limit)
            self.set_tunnel(webhook.host, webhook.port, _authorization(proxy.netloc))
        self.default_port = _PORTS[webhook.scheme]  # keeps Host short
        self._tls_name = webhook.host if webhook.scheme == "https" else None
        self.is_late = False
        """Whether the connection was cut because its time was over."""
        self._end = threading.Timer(limit, self._cut)
        self._end.daemon = True

    def __enter__(self) -> "_Connection":
        self._end.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.cancel()
        self.close()

    def _cut(self) -> None:
        self.is_late = True
        # The other errors: not connected yet, or closed.
        with contextlib.suppress(OSError, AttributeError, TypeError):
            # SSLSocket.shutdown would remove the encryption while the other thread uses it.
            socket.socket.shutdown(self.sock, socket.SHUT_RDWR)

    def require_time(self) -> None:
        """Raise TimeoutError if the time is over: the answer read may be incomplete."""
        if self.is_late:
            raise TimeoutError

    def connect(self) -> None:
        super().connect()
        if self._tls_name is not None:
            context = ssl.create_default_context()
            self.sock = context.wrap_socket(
                self.sock, server_hostname=self._tls_name, do_handshake_on_connect=False
            )
            self.require_time()
            self.sock.do_handshake()
        self.require_time()


def _proxy(host: str) -> SplitResult | None:
    address = getproxies().get("https")
    if not address or proxy_bypass(host):
        return None
    return urlsplit(address if "://" in address else f"http://{address}")


def _authorization(place: str) -> dict[str, str]:
    user, at, _ = place.rpartition("@")
    if not at:
        return {}
    return {"Proxy-Authorization": f"Basic {base64.b64encode(unquote(user).encode()).decode()}"}


def post(webhook: Webhook, body: bytes, secrets: Secrets, limit: float = 10.0) -> None:
    """Post a JSON body to a webhook within `limit` seconds, plus the time of the name look-up.

    Only the status line and the headers of the answer are read; ``http.client`` bounds their size.
    Redirects are not followed. Certificate and host name are verified against the authorities of
    the system or of ``SSL_CERT_FILE``. The proxy in ``https_proxy`` is used unless ``no_proxy``
    exempts the host, and never for this machine.

    Raises
    ------
    DeliveryError
        Unless the answer is a success (2xx).
    """
    headers = {
        "Content-Type": "application/json",
        "User-Agent": "valve_friction_ros",
        "Connection": "close",
        **secrets.headers(body, int(time.time())),
    }
    try:
        with _Connection(webhook, limit) as connection:
            try:
                connection.request("POST", webhook.target, body, headers)
                with connection.getresponse() as response:
                    status = response.status
                connection.require_time()
            except (OSError, http.client.HTTPException, ValueError) as error:
                raise _delivery_error(webhook, error, connection.is_late, limit) from None
    except ValueError:  # the port of a proxy
        raise DeliveryError(
            "the proxy set in the environment is not an address: correct it", True
        ) from None
    if not 200 <= status < 300:
        is_redirect = 300 <= status < 400
        raise DeliveryError(
            f"{webhook} answered {status}"
            + (", and redirects are not followed: name the final address" if is_redirect else ""),
            is_final=status < 500 and status not in _RETRIED,
        )


def _delivery_error(
    webhook: Webhook, error: Exception, is_late: bool, limit: float
) -> DeliveryError:
    if is_late or isinstance(error, TimeoutError):
        return DeliveryError(f"{webhook} did not answer within {limit:g} s", is_answered=False)
    if isinstance(error, ssl.SSLCertVerificationError):
        return DeliveryError(
            f"the certificate of {webhook} is not trusted: {error.verify_message}: correct the "
            "server, or set SSL_CERT_FILE to the file of its certificate authority",
            is_final=True,
        )
    if isinstance(error, OSError):
        cause = error.strerror or type(error).__name__
        return DeliveryError(f"{webhook}: {cause}", is_answered=False)
    return DeliveryError(f"{webhook} did not answer with HTTP ({type(error).__name__})")


_LONGEST_WAIT = 300.0
_TRIES = 20

WAITS = tuple(accumulate(repeat(1.0, _TRIES - 1), lambda wait, _: min(2 * wait, _LONGEST_WAIT)))
"""Waiting times between attempts, s: 1, 2, 4 … 300; an hour in all."""

_MOST_WAITING = 100
"""Largest number of waiting alerts per valve; beyond it the oldest is given up."""


class OutboxState(NamedTuple):
    """State of the alerts of one valve.

    Attributes
    ----------
    waiting, delivered, given_up : int
        Numbers of alerts. An alert is given up after a refusal, after the last attempt, or when the
        queue is full.
    problem : str or None
        Cause of the last failed attempt; None if the last attempt succeeded.
    lost : str or None
        The alert given up last and the cause, until a later alert is delivered.
    settled : Level or None
        Level of the alert delivered or given up last; None without any.
    """

    waiting: int
    delivered: int
    given_up: int
    problem: str | None
    lost: str | None
    settled: Level | None = None


class Outbox:
    """The alerts of one valve to a webhook, sent in order: the last one to arrive is the newest.

    `due`, `begin` and `end` need the lock of the sender.
    """

    def __init__(
        self,
        webhook: Webhook,
        changed: threading.Condition,
        waits: tuple[float, ...],
        wake: Callable[[], None],
    ) -> None:
        self.webhook = webhook
        self.tried = 0.0
        """Time of the last attempt, s of the monotonic clock."""
        self._changed, self._waits, self._wake = changed, waits, wake
        self._letters: deque[Letter] = deque()
        self._tries = 0
        """Attempts for the first letter."""
        self._is_sending = False
        self._due = 0.0
        self._delivered = self._given_up = 0
        self._problem: str | None = None
        self._lost: str | None = None
        self._settled: Level | None = None

    def put(self, letter: Letter) -> None:
        """Queue a letter and return at once."""
        with self._changed:
            self._letters.append(letter)
            if len(self._letters) > _MOST_WAITING:
                oldest = 1 if self._is_sending else 0
                self._give_up(oldest, f"more than {_MOST_WAITING} alerts are waiting")
            self._wake()

    def state(self) -> OutboxState:
        """Return the numbers of alerts and the present problem."""
        with self._changed:
            waiting = len(self._letters)
            counts = waiting, self._delivered, self._given_up
            return OutboxState(*counts, self._problem, self._lost, self._settled)

    def due(self) -> float:
        """Return the time of the next attempt, s of the monotonic clock; inf if nothing waits."""
        return self._due if self._letters else math.inf

    def begin(self) -> Letter:
        """Return the letter to try now."""
        self._is_sending, self.tried = True, time.monotonic()
        return self._letters[0]

    def end(self, failure: DeliveryError | None) -> None:
        """Record the outcome of an attempt for the first letter."""
        self._is_sending = False
        if failure is None:
            self._delivered += 1
            self._settle(0)
            self._problem = self._lost = None
            return
        self._problem = str(failure)
        self._tries += 1
        if failure.is_final or self._tries > len(self._waits):
            self._give_up(0, str(failure))
        else:
            self._due = time.monotonic() + self._waits[self._tries - 1]

    def _give_up(self, place: int, cause: str) -> None:
        self._given_up += 1
        self._lost = f"{self._settle(place).title} was not delivered: {cause}"

    def _settle(self, place: int) -> Letter:
        """Remove a letter from the queue, and return it."""
        letter = self._letters[place]
        del self._letters[place]
        if place == 0:
            self._tries = 0
        if letter.new_level is not None:
            self._settled = letter.new_level
        return letter


class AlertSender:
    """Sends the alerts of many valves, to each host in a thread that starts with its first alert.

    A host thus gets one attempt at a time, and a slow or dead host does not delay the alerts to the
    others. The threads block neither their callers nor the exit of the process; alerts that still
    wait at exit are lost.

    Parameters
    ----------
    secrets : Secrets, optional
        By default those of the environment, read at each attempt.
    waits : iterable of float
        Waiting times between attempts, s; there is one more attempt than there are waits.
    limit : float
        Longest time of an attempt, s.
    """

    def __init__(
        self, secrets: Secrets | None = None, waits: Iterable[float] = WAITS, limit: float = 10.0
    ) -> None:
        self._secrets = secrets
        self._waits = tuple(waits)
        self._limit = limit
        self._changed = threading.Condition()
        self._outboxes: defaultdict[Place, list[Outbox]] = defaultdict(list)
        self._begun: set[Place] = set()
        self._is_closed = False

    def outbox(self, webhook: Webhook) -> Outbox:
        """Return a new queue for one valve and its webhook."""
        outbox = Outbox(webhook, self._changed, self._waits, partial(self._wake, webhook.place))
        with self._changed:
            self._outboxes[webhook.place].append(outbox)
        return outbox

    def _wake(self, place: Place) -> None:
        """Wake the thread of a host; the caller holds the lock."""
        if place not in self._begun and not self._is_closed:
            self._begun.add(place)
            work = (self._outboxes[place],)
            threading.Thread(target=self._run, args=work, name="alerts", daemon=True).start()
        self._changed.notify_all()

    def close(self) -> None:
        """Start no more attempts; returns at once, though some may still be under way."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def _run(self, outboxes: list[Outbox]) -> None:
        """Try the alerts to one host as they become due, until closed."""
        while (work := self._next(outboxes)) is not None:
            outbox, letter = work
            failure = self._failure(letter, outbox.webhook)
            with self._changed:
                outbox.end(failure)
                if failure is not None and not failure.is_answered:
                    # A dead host shared by many valves is tried once per round.
                    now = time.monotonic()
                    for other in outboxes:
                        if other.due() <= now:
                            other.end(failure)

    def _next(self, outboxes: list[Outbox]) -> tuple[Outbox, Letter] | None:
        """Wait for the next attempt, and return it; None once closed."""
        with self._changed:
            while not self._is_closed:
                now = time.monotonic()
                if due := [one for one in outboxes if one.due() <= now]:
                    outbox = min(due, key=lambda one: one.tried)
                    return outbox, outbox.begin()
                later = min(one.due() for one in outboxes)
                self._changed.wait(None if later == math.inf else later - now)
        return None

    def _failure(self, letter: Letter, webhook: Webhook) -> DeliveryError | None:
        try:
            if (secrets := self._secrets) is None:
                secrets = Secrets.from_environment().going_to(webhook)
            post(webhook, letter.body(), secrets, self._limit)
        except DeliveryError as failure:
            return failure
        except Exception as bug:  # noqa: BLE001 - the thread serves other valves, too
            return DeliveryError(f"internal error: {type(bug).__name__}", is_final=True)
        return None
