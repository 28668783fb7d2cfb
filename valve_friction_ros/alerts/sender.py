"""The queues of alerts of all valves of a process, and the threads that send them."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import accumulate, repeat
from typing import NamedTuple

from valve_friction_ros.alerts.alert import Alert
from valve_friction_ros.alerts.posting import DeliveryError, post
from valve_friction_ros.alerts.webhook import Place, Secrets, Webhook
from valve_friction_ros.health import Level

__all__ = ["WAITS", "AlertSender", "Outbox", "OutboxState"]

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
class _Letter:
    alert: Alert
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
        self._letters: deque[_Letter] = deque()
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

    def put(self, alert: Alert) -> None:
        """Have an alert sent; returns at once. Without a webhook it is dropped."""
        with self._changed:
            if self._webhook is None:
                return
            self._letters.append(_Letter(alert))
            if len(self._letters) > _MOST_WAITING:
                oldest = 1 if self._is_sending else 0
                self._give_up(self._letters[oldest], f"more than {_MOST_WAITING} wait")
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

    def begin(self) -> tuple[_Letter, Webhook]:
        """Take what is to be tried now; the caller holds the lock."""
        assert self._webhook is not None  # noqa: S101 - else nothing waits
        self._is_sending, self._tried = True, time.monotonic()
        return self._letters[0], self._webhook

    def skip(self, failure: DeliveryError) -> None:
        """Count a try that would fail as another valve's has; the caller holds the lock."""
        if self._webhook is not None:
            self.end(self._letters[0], self._webhook, failure)

    def end(self, letter: _Letter, webhook: Webhook, failure: DeliveryError | None) -> None:
        """Note how the try has ended; the caller holds the lock."""
        self._is_sending = False
        if webhook != self._webhook:
            return
        with contextlib.suppress(ValueError):  # dropped meanwhile
            if failure is None:
                self._letters.remove(letter)
                self._delivered += 1
                self._settled = letter.alert.new_level
                self._problem = self._lost = None
                return
            place = self._letters.index(letter)
            self._problem = str(failure)
            letter.tries += 1
            if failure.is_final or letter.tries > len(self._waits):
                del self._letters[place]
                self._give_up(letter, str(failure))
            else:
                self._due = time.monotonic() + self._waits[letter.tries - 1]

    def is_due_at(self, place: Place, now: float) -> bool:
        """Return whether a try at a host is due; the caller holds the lock."""
        due = self.due()
        return self.place == place and due is not None and due <= now

    def _give_up(self, letter: _Letter, cause: str) -> None:
        self._given_up += 1
        alert = letter.alert
        self._settled = alert.new_level
        self._lost = (
            f"the alert {alert.old_level.name} → {alert.new_level.name} of "
            f"{alert.time:%Y-%m-%d %H:%M:%S} UTC was not delivered: {cause}"
        )


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

    def _try(self, outbox: Outbox, letter: _Letter, webhook: Webhook) -> None:
        failure = self._failure(letter.alert, webhook)
        with self._changed:
            outbox.end(letter, webhook, failure)
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

    def _failure(self, alert: Alert, webhook: Webhook) -> DeliveryError | None:
        try:
            if (secrets := self._secrets) is None:
                secrets = Secrets.from_environment().going_to(webhook)
            post(webhook, alert.body(), secrets, self._limit)
        except DeliveryError as failure:
            return failure
        except Exception as bug:  # noqa: BLE001 - the thread serves other valves, too
            return DeliveryError(f"internal error: {type(bug).__name__}", is_final=True)
        return None
