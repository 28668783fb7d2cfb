# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The ledger as rows with goals."""

from collections import Counter
from collections.abc import Iterator, Mapping

from benchmark.harness.processes import CODES
from benchmark.harness.rows import Row, none, some
from benchmark.harness.run import Events, by_kind
from benchmark.soak.feed import TOLD_WITHIN
from benchmark.soak.plant import Kept

_KILLED = "SIGKILL"
_BUSY = "already running"
"""Words of a refusal without a record, so that nothing is stored."""
_MIDDLE, _GROWTH = 0.5, 1.05
"""Middle of the month, and limit of the final over the middle memory, of the lasting process."""


def _samples(lives: Events) -> Iterator[Row]:
    sent, taken, rejected = (
        sum(one[name] for one in lives) for name in ("sent", "taken", "rejected")
    )
    yield some("samples sent", sent)
    yield Row("samples taken", taken)
    yield Row("samples rejected with a cause", rejected)
    open_ = [(one["end"], one["sent"] - one["taken"] - one["rejected"]) for one in lives]
    killed = sum(count for end, count in open_ if end == _KILLED)
    yield Row("sent in the last second before a kill, or never told", killed)
    yield none("samples unexplained", sum(abs(count) for end, count in open_ if end != _KILLED))


def _identifications(calls: Events, lives: Events, stored: Mapping[str, int]) -> Iterator[Row]:
    everything = [one for one in calls if one["service"] == "identify"]
    asked = [one for one in everything if _BUSY not in (one.get("message") or "")]
    answered = [one for one in asked if one["seconds"] is not None]
    cut = [one for one in asked if one.get("ended")]
    yield Row("identifications asked", len(everything), "", goal="some", met=bool(asked))
    yield Row("refused, as another one ran", len(everything) - len(asked))
    yield Row("answered with a result", sum(bool(one["success"]) for one in answered))
    yield Row("answered with a refusal", sum(not one["success"] for one in answered))
    yield Row("under way when the process ended", len(cut))
    yield none("never answered", len(asked) - len(answered) - len(cut))
    kept = sum(stored.values())
    yield Row("stored in the history", kept)
    ended = sum(one["unsaved"] for one in lives if one["end"] == _KILLED)
    yield Row("waiting for a full disk at a kill", ended)
    lost = extra = 0
    for valve, count in stored.items():
        waiting = sum(one["unsaved"] for one in lives if one["valve"] == valve)
        mine = sum(one["valve"] == valve for one in answered)
        unanswered = sum(one["valve"] == valve for one in asked) - mine
        lost += max(mine - waiting - count, 0)
        extra += max(count - mine - unanswered, 0)
    yield none("answered, and not in the history", lost)
    yield none("in the history, and never asked", extra)
    if answered:
        yield Row("longest answer", max(one["seconds"] for one in answered), "s")


def _memory(looks: Events) -> Iterator[Row]:
    """Compare the end with the middle, by which time every part of the package has been used."""
    by_share = {one["share"]: one["megabytes"] for one in looks}
    for share, size in by_share.items():
        item = f"memory after {100 * share:.0f} % of the month"
        if share == 1.0 and _MIDDLE in by_share:
            goal, middle = f"under {_GROWTH:g} times", by_share[_MIDDLE]
            yield Row(item, size, "MB", middle, "in the middle", goal, size < _GROWTH * middle)
        else:
            yield Row(item, size, "MB")


def _nonsense(begun: Events, ended: Events) -> Iterator[Row]:
    """Check that each kind of nonsense is reported, and cleared, within the time limit."""
    yield Row("kinds of nonsense that sensors said", len({one["name"] for one in begun}), "of 11")
    for item, events in (("told", begun), ("over", ended)):
        late = [one for one in events if not (one["told"] and one["seconds"] <= TOLD_WITHIN)]
        yield none(f"nonsense that was not {item} within {TOLD_WITHIN:g} s", len(late))
        if events:
            longest = max(one["seconds"] for one in events)
            yield Row(f"longest until nonsense was {item}", longest, "s")


def rows(events: Events, stored: Mapping[str, int]) -> Iterator[Row]:
    """Account for all events; `stored` is the number of identifications in the history by valve."""
    of = by_kind(events)
    faults = Counter(one["name"] for one in of["fault"])
    for name, count in sorted(faults.items()):
        yield Row(f"fault: {name}", count)
    lives = of["life"]
    yield from _samples(lives)
    yield from _identifications(of["call"], lives, stored)
    others = [one for one in of["call"] if one["service"] != "identify"]
    yield Row("other calls", len(others))
    never = sum(one["seconds"] is None and not one.get("ended") for one in others)
    yield none("other calls never answered", never)
    for kind, item in (
        ("silence", "silent sensors"),
        ("full disk", "full disks"),
        ("database away", "databases away"),
    ):
        yield none(f"{item} that nobody told", sum(not one["told"] for one in of[kind]))
    yield from _nonsense(of["nonsense"], of["nonsense over"])
    for end in of["ending"]:
        if end["code"] not in CODES:
            item, code = f"{end['name']} ended with code", end["code"] or -1
            yield Row(item, code, "", goal="that of its signal", met=False)
    yield none("processes that ended by themselves", len(of["died"]))
    yield from _memory(of["memory"])


def database_rows(kept: Kept) -> Iterator[Row]:
    """Yield the final contents of history file and server."""
    yield Row("identifications in the file", kept.in_file)
    is_same = kept.on_server == kept.in_file
    yield Row("identifications on the server", kept.on_server, "", goal="as many", met=is_same)
    yield Row("rows that wait for the next start", kept.waiting)
    # A sent row may still wait, until the node knows that it has arrived.
    lost = max(kept.lacking - kept.waiting, 0)
    yield none("rows that the server lacks and that do not wait", lost)
