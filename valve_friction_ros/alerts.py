# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alerts: a change of a valve's level, posted to a webhook; no ROS.

An `AlertSender` holds the queues of all valves of a process and the threads that send them; each
try is bounded in time and memory, whatever the other side does.
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
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from itertools import accumulate, repeat
from typing import NamedTuple, Protocol
from urllib.parse import SplitResult, unquote, urlsplit
from urllib.request import getproxies, proxy_bypass

from valve_friction_ros.health import Level
from valve_friction_ros.loopback import is_loopback


def _now() -> datetime:
    return datetime.now(timezone.utc)


class Letter(Protocol):
    """What is posted: a change of level, or something that tells no level."""

    @property
    def new_level(self) -> Level | None:
        """The level that it tells, if any."""

    @property
    def title(self) -> str:
        """What it is, for whoever hears that it was not delivered."""

    def body(self) -> bytes:
        """Return it as JSON."""


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
        The level that was told last, and that of now.
    ne_107 : str
        Status signal of NE 107; empty: good.
    message : str
        The message of the diagnosis.
    friction_ratio : float or None
        Friction over its baseline; None or nan where it is not known.
    time : datetime
        When the level was seen, by the system's clock, UTC.
    event_id : str
        The same at each try, so that a receiver counts an event once.
    alarms : mapping of str to str
        States of the alarms that are not normal, by their names.
    """

    valve: str
    node: str
    old_level: Level
    new_level: Level
    ne_107: str
    message: str
    friction_ratio: float | None = None
    time: datetime = field(default_factory=_now)
    event_id: str = field(default_factory=lambda: uuid.uuid4().hex)
    alarms: Mapping[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The change and its time."""
        change = f"{self.old_level.name} → {self.new_level.name}"
        return f"the alert {change} of {self.time:%Y-%m-%d %H:%M:%S} UTC"

    def body(self) -> bytes:
        """Return the alert as JSON: the attributes by name, the time after ISO 8601."""
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
"""Header with the signature."""

URL_VARIABLE = "VALVE_FRICTION_WEBHOOK_URL"
"""Variable of the environment with the address that the token is for."""
_SECRET = "VALVE_FRICTION_WEBHOOK_SECRET"  # noqa: S105 - the name of a variable
_TOKEN = "VALVE_FRICTION_WEBHOOK_TOKEN"  # noqa: S105

Place = tuple[str, str, int]
"""Scheme, host and port."""

_PORTS = {"https": 443, "http": 80}


@dataclass(frozen=True)
class Webhook:
    """The address of a webhook.

    As text it has neither path nor query, which hold secrets of many services.

    Attributes
    ----------
    scheme : str
        ``https``, or ``http`` to this machine.
    host : str
        Name or address.
    port : int
        Its port.
    target : str
        Path and query.
    """

    scheme: str
    host: str
    port: int
    target: str = field(repr=False)

    @classmethod
    def at(cls, url: str, name: str = "webhook_url") -> "Webhook":
        """Read the address of a webhook; `name` is what errors call it.

        Raises ValueError, without the address, if it is none, is not encrypted on its way to
        another machine, or holds a name or a password.
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
                f"{name} holds a name or a password, which everyone on the ROS graph can read: "
                f"put a token into the environment variable {_TOKEN}"
            )
        if parts.scheme == "http" and not is_loopback(host):
            raise ValueError(
                f"{name} uses http to another machine, where anyone on the path can read and "
                "change it: use https, or a relay on this machine"
            )
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        return cls(parts.scheme, host, _PORTS[parts.scheme] if port is None else port, target)

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Webhook | None":
        """Read ``VALVE_FRICTION_WEBHOOK_URL``, if it is set; raises ValueError like `at`."""
        url = environment.get(URL_VARIABLE, "").strip()
        return cls.at(url, URL_VARIABLE) if url else None

    @property
    def place(self) -> Place:
        """Its host."""
        return self.scheme, self.host, self.port

    @property
    def is_encrypted(self) -> bool:
        """Whether alerts go there by TLS."""
        return self.scheme == "https"

    @property
    def is_here(self) -> bool:
        """Whether it is on this machine."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        """Return scheme, host and port."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


@dataclass(frozen=True)
class Secrets:
    """What the receiver of an alert knows its sender by; never shown.

    Attributes
    ----------
    secret : str
        Key of the signature; empty: no signature.
    token : str
        Bearer token, for the address in the environment alone; empty: none.
    """

    secret: str = field(default="", repr=False)
    token: str = field(default="", repr=False)

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Secrets":
        """Read ``VALVE_FRICTION_WEBHOOK_SECRET`` and ``VALVE_FRICTION_WEBHOOK_TOKEN``.

        Raises ValueError, without the token, if it cannot stand in a header.
        """
        secret, token = (environment.get(name, "").strip() for name in (_SECRET, _TOKEN))
        if not token.isascii() or (token and not token.isprintable()) or " " in token:
            raise ValueError(f"{_TOKEN} contains a space or a non-ASCII character: correct it")
        return cls(secret, token)

    def going_to(self, webhook: Webhook, environment: Mapping[str, str] = os.environ) -> "Secrets":
        """Return what may go to a webhook: the token only to the address of the environment.

        Who may give a parameter is not always who may have the token. The key of the signature goes
        nowhere.
        """
        with contextlib.suppress(ValueError):
            if webhook == Webhook.from_environment(environment):
                return self
        return Secrets(self.secret)

    def headers(self, body: bytes, time: int) -> dict[str, str]:
        """Return the headers that vouch for a body sent at `time`, s since 1970."""
        headers = {}
        if self.secret:
            headers[SIGNATURE] = signature(self.secret, body, time)
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        return headers


def signature(secret: str, body: bytes, time: int) -> str:
    """Sign a body that is sent at `time`, s since 1970 (UTC).

    It is ``t=time,v1=digest``, the digest HMAC-SHA256 of time, a full stop and the body, in
    hexadecimal digits. A receiver computes the same, compares in constant time, and refuses old
    times.
    """
    signed = f"{time}.".encode() + body
    return f"t={time},v1={hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()}"


_RETRIED = frozenset({408, 425, 429})
"""Answers beside 5xx after which a later try may succeed: time-out, too early, too many."""


class DeliveryError(Exception):
    """An alert was not delivered; the message says why, without any secret.

    Attributes
    ----------
    is_final : bool
        Whether another try would end alike, until somebody changes something.
    is_answered : bool
        Whether the host has answered; else the next letter to it would fare alike.
    """

    def __init__(self, cause: str, is_final: bool = False, is_answered: bool = True) -> None:
        super().__init__(cause)
        self.is_final = is_final
        self.is_answered = is_answered


class _Connection(http.client.HTTPConnection):
    """A connection that ends after a time, also while it is being made."""

    def __init__(self, webhook: Webhook, limit: float) -> None:
        proxy = None if webhook.is_here else _proxy(webhook.host)
        if proxy is None:
            super().__init__(webhook.host, webhook.port, timeout=limit)
        else:
            super().__init__(proxy.hostname or "", proxy.port or 80, timeout=limit)
            self.set_tunnel(webhook.host, webhook.port, _authorization(proxy.netloc))
        self.default_port = 443 if webhook.is_encrypted else 80  # so that Host is short
        self._tls_name = webhook.host if webhook.is_encrypted else None
        self._is_late = False
        self._end = threading.Timer(limit, self._cut)
        self._end.daemon = True

    def __enter__(self) -> "_Connection":
        self._end.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.cancel()
        self.close()

    def _cut(self) -> None:
        self._is_late = True
        with contextlib.suppress(
            OSError, AttributeError, TypeError
        ):  # not connected yet, or closed
            # That of SSLSocket would take the encryption away from under the other thread.
            socket.socket.shutdown(self.sock, socket.SHUT_RDWR)

    def require_time(self) -> None:
        """Raise TimeoutError if its time is over: what it has read may be a part."""
        if self._is_late:
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

    @property
    def is_late(self) -> bool:
        """Whether it was ended because its time was over."""
        return self._is_late


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
    """Post a JSON body to a webhook, within `limit` seconds and the look-up of its name.

    Of the answer only status line and headers are read, which ``http.client`` bounds; a redirect
    is not followed. Certificate and host name are verified, by the authorities of the system or
    of ``SSL_CERT_FILE``. A proxy is used where ``https_proxy`` names one, and ``no_proxy`` does not
    exempt the host; never for this machine.

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
"""Times, s, from each failed try to the next: 1, 2, 4 … 300; an hour in all."""

_MOST_TRIES, _MOST_RETRIES = 16, 8
"""Hosts that are tried at once, and those among them that have not answered when tried last: so
dead hosts leave room for the others."""

_MOST_WAITING = 100
"""Alerts of a valve that wait; then the oldest is given up."""


class OutboxState(NamedTuple):
    """The alerts of one valve.

    Attributes
    ----------
    waiting, delivered, given_up : int
        Numbers of alerts; those given up were refused, tried in vain, or had to make room.
    problem : str or None
        Why the last try has failed; None if it has not.
    lost : str or None
        Which alert was given up, and why, until a later one is delivered.
    settled : Level or None
        The level of the alert that was delivered or given up last; None without any.
    """

    waiting: int
    delivered: int
    given_up: int
    problem: str | None
    lost: str | None
    settled: Level | None = None


@dataclass(eq=False)
class _QueuedLetter:
    letter: Letter
    tries: int = 0


class Outbox:
    """The alerts of one valve, sent in their order: the last one that arrives is the newest."""

    def __init__(
        self,
        changed: threading.Condition,
        waits: tuple[float, ...],
        wake: Callable[[], None],
    ) -> None:
        self._changed, self._waits, self._wake = changed, waits, wake
        self._letters: deque[_QueuedLetter] = deque()
        self._is_sending = False
        self._due = self._tried = 0.0
        self._webhook: Webhook | None = None
        self._delivered = self._given_up = 0
        self._problem: str | None = None
        self._lost: str | None = None
        self._settled: Level | None = None

    def address(self, webhook: Webhook | None) -> None:
        """Send to this webhook from now on, also what waits; None: drop it, and send nothing."""
        if webhook == self._webhook:
            return
        with self._changed:
            self._webhook, self._due = webhook, 0.0
            self._problem = self._lost = None
            if webhook is None:
                self._letters.clear()
            elif self._letters:
                self._wake()

    def put(self, letter: Letter) -> None:
        """Have a letter sent; returns at once. Without a webhook it is dropped."""
        with self._changed:
            if self._webhook is None:
                return
            self._letters.append(_QueuedLetter(letter))
            if len(self._letters) > _MOST_WAITING:
                oldest = 1 if self._is_sending else 0
                self._give_up(
                    self._letters[oldest], f"more than {_MOST_WAITING} alerts are waiting"
                )
                del self._letters[oldest]
            self._wake()

    def state(self) -> OutboxState:
        """Return the numbers of alerts, and what is wrong."""
        with self._changed:
            waiting = len(self._letters)
            counts = waiting, self._delivered, self._given_up
            return OutboxState(*counts, self._problem, self._lost, self._settled)

    @property
    def place(self) -> Place | None:
        """Scheme, host and port that alerts go to; None without a webhook."""
        return None if self._webhook is None else self._webhook.place

    @property
    def tried(self) -> float:
        """When it was tried last, s of the monotonic clock."""
        return self._tried

    def due(self) -> float | None:
        """Return when the next try is due, s of the monotonic clock; None if nothing waits."""
        return self._due if self._letters else None

    def begin(self) -> tuple[_QueuedLetter, Webhook]:
        """Take what is to be tried now; the caller holds the lock."""
        assert self._webhook is not None  # noqa: S101 - else nothing waits
        self._is_sending, self._tried = True, time.monotonic()
        return self._letters[0], self._webhook

    def skip(self, failure: DeliveryError) -> None:
        """Count a try that would fail as another valve's has; the caller holds the lock."""
        if self._webhook is not None:
            self.end(self._letters[0], self._webhook, failure)

    def end(self, queued: _QueuedLetter, webhook: Webhook, failure: DeliveryError | None) -> None:
        """Note how the try has ended; the caller holds the lock."""
        self._is_sending = False
        if webhook != self._webhook:
            return
        with contextlib.suppress(ValueError):  # dropped meanwhile
            if failure is None:
                self._letters.remove(queued)
                self._delivered += 1
                self._settle(queued)
                self._problem = self._lost = None
                return
            place = self._letters.index(queued)
            self._problem = str(failure)
            queued.tries += 1
            if failure.is_final or queued.tries > len(self._waits):
                del self._letters[place]
                self._give_up(queued, str(failure))
            else:
                self._due = time.monotonic() + self._waits[queued.tries - 1]

    def is_due_at(self, place: Place, now: float) -> bool:
        """Return whether a try at a host is due; the caller holds the lock."""
        due = self.due()
        return self.place == place and due is not None and due <= now

    def _give_up(self, queued: _QueuedLetter, cause: str) -> None:
        self._given_up += 1
        self._settle(queued)
        self._lost = f"{queued.letter.title} was not delivered: {cause}"

    def _settle(self, queued: _QueuedLetter) -> None:
        if queued.letter.new_level is not None:
            self._settled = queued.letter.new_level


class AlertSender:
    """Sends the alerts of many valves in threads of its own, the first of which begins with them.

    One thread looks for what is due; each try is a thread, one for a host at a time and 16 in all,
    so that no host that is slow or dead holds up the alerts to another. The threads hold up
    neither their callers nor the end of the process; what waits then is lost.

    Parameters
    ----------
    secrets : Secrets, optional
        By default those of the environment, read at each try.
    waits : iterable of float
        Times, s, from each failed try to the next; one try more is made than there are waits.
    limit : float
        Longest time of a try, s.
    """

    def __init__(
        self, secrets: Secrets | None = None, waits: Iterable[float] = WAITS, limit: float = 10.0
    ) -> None:
        self._secrets = secrets
        self._waits = tuple(waits)
        self._limit = limit
        self._changed = threading.Condition()
        self._outboxes: list[Outbox] = []
        self._under_way: dict[Place, bool] = {}
        """Hosts that are tried, and whether they have not answered before."""
        self._silent: set[Place] = set()
        self._is_closed = False
        self._thread: threading.Thread | None = None

    def outbox(self) -> Outbox:
        """Return a new queue, for one valve."""
        outbox = Outbox(self._changed, self._waits, self._wake)
        with self._changed:
            self._outboxes.append(outbox)
        return outbox

    def _wake(self) -> None:
        """Have the thread look at the queues; the caller holds the lock."""
        if self._thread is None and not self._is_closed:
            self._thread = threading.Thread(target=self._run, name="alerts", daemon=True)
            self._thread.start()
        self._changed.notify()

    def close(self) -> None:
        """Send nothing more; returns at once, while tries may still be under way."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def _run(self) -> None:
        """Begin what is due, until the end."""
        with self._changed:
            while not self._is_closed:
                now = time.monotonic()
                waiting = [(due, one) for one in self._outboxes if (due := one.due()) is not None]
                for _, outbox in sorted(waiting, key=lambda each: each[1].tried):
                    self._begin(outbox, now)
                later = [due for due, _ in waiting if due > now]
                self._changed.wait(min(later) - now if later else None)

    def _begin(self, outbox: Outbox, now: float) -> None:
        """Try the first alert of a queue, if it is due and there is room."""
        place = outbox.place
        if place is None or place in self._under_way or not outbox.is_due_at(place, now):
            return
        is_silent, retries = place in self._silent, sum(self._under_way.values())
        if len(self._under_way) >= _MOST_TRIES or (is_silent and retries >= _MOST_RETRIES):
            return
        self._under_way[place] = is_silent
        work = outbox, *outbox.begin()
        threading.Thread(target=self._try, args=work, name="alert", daemon=True).start()

    def _try(self, outbox: Outbox, queued: _QueuedLetter, webhook: Webhook) -> None:
        failure = self._failure(queued.letter, webhook)
        with self._changed:
            outbox.end(queued, webhook, failure)
            del self._under_way[webhook.place]
            if failure is None or failure.is_answered:
                self._silent.discard(webhook.place)
            else:
                self._silent.add(webhook.place)
                self._fail_together(webhook, failure)
            self._changed.notify()

    def _fail_together(self, webhook: Webhook, failure: DeliveryError) -> None:
        """Count the failure as a try of all that is due at a host that does not answer.

        So a dead host of many valves is tried once a round.
        """
        now = time.monotonic()
        for outbox in self._outboxes:
            if outbox.is_due_at(webhook.place, now):
                outbox.skip(failure)

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
