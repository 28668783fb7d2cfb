# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The events of a run as rows with their goals."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from benchmark.churn.places import process_of
from benchmark.churn.processes import CODES
from benchmark.churn.visitor import ANSWER_LIMIT
from benchmark.speed.rows import Row

__all__ = ["END_LIMIT", "hung_services", "rows"]

END_LIMIT = 3.0
"""Time, s, within which a node ends when it is told to."""
_SILENCE_LIMIT = 5.0
_LOOKED_AT, _LATE = 0.95, 60.0
"""Share of the stream to be looked at, without its first and last seconds."""
_Events = Sequence[Mapping[str, Any]]


def hung_services(events: _Events, until: float = math.inf) -> list[str]:
    """Return the services without an answer whose process has answered nobody else meanwhile.

    Those that were found `until` a time count, s since 1970.

    One client may lose its answers; a node that hangs answers none.
    """
    answered: dict[str, float] = {}
    for one in events:
        if one["kind"] == "call" and one["seconds"] is not None:
            answered[process_of(one["service"])] = one["time"]
    return [
        one["service"]
        for one in events
        if one["kind"] == "unanswered twice"
        and one["time"] < until
        and answered.get(process_of(one["service"]), 0.0) < one["since"]
    ]


def _calls(calls: _Events) -> Iterator[Row]:
    answered = [one["seconds"] for one in calls if one["seconds"] is not None]
    yield Row("calls of services and parameters", len(calls), "", goal="some", met=bool(calls))
    by_name = Counter(one["service"].rpartition("/")[2] for one in calls)
    for name, count in sorted(by_name.items()):
        times = [
            one["seconds"] or np.inf for one in calls if one["service"].rpartition("/")[2] == name
        ]
        yield Row(f"  {name} ({count}): longest answer", max(times), "s")
    if answered:
        yield Row("median answer", float(np.median(answered)), "s")
        yield Row("answer of 99 in 100", float(np.quantile(answered, 0.99)), "s")
    late = sum(1 for time in answered if time > ANSWER_LIMIT)
    yield Row(f"answered after more than {ANSWER_LIMIT:g} s", late, "", goal="none", met=late == 0)
    lost = len(calls) - len(answered)
    yield Row("never answered", lost, "", goal="none", met=lost == 0)


def _samples(bags: _Events, unsaved: int, seconds: float) -> Iterator[Row]:
    missing = sum(one["missing"] for one in bags)
    holes, covered = 0, 0.0
    for topic in sorted({one["topic"] for one in bags}):
        mine = [one for one in bags if one["topic"] == topic and one["count"]]
        covered += sum(
            later["last"] - max(earlier["last"], later["first"])
            for earlier, later in itertools.pairwise(mine)
        )
        covered += mine[0]["last"] - mine[0]["first"] if mine else 0
        holes += sum(
            later["first"] > earlier["last"] for earlier, later in itertools.pairwise(mine)
        )
    least = 2 * _LOOKED_AT * (seconds - _LATE)
    goal, met = f"at least {least:.0f} s", covered / 1e9 >= least
    yield Row("stream looked at, both signals", covered / 1e9, "s", goal=goal, met=met)
    yield Row("samples lost", missing, "", goal="none", met=missing == 0)
    late = holes + unsaved
    yield Row("times at which the look came too late", late, "", goal="none", met=late == 0)


def _endings(endings: _Events) -> Iterator[Row]:
    times = [one["seconds"] for one in endings if one["seconds"] is not None]
    some = bool(endings)
    yield Row("nodes ended by SIGINT or SIGTERM", len(endings), "", goal="some", met=some)
    if times:
        yield Row("longest time to their end", max(times), "s")
    bad = sum(one["seconds"] is None or one["seconds"] > END_LIMIT for one in endings)
    yield Row(f"ended after more than {END_LIMIT:g} s", bad, "", goal="none", met=bad == 0)
    early = sum(one["code"] in CODES[1:] for one in endings)
    yield Row("ended by the signal itself, before Python ran", early, "")
    codes = sum(one["code"] not in CODES for one in endings)
    yield Row("ended with another code", codes, "", goal="none", met=codes == 0)


def rows(events: _Events) -> Iterator[Row]:
    """Count what happened, and compare it with what is promised."""

    def of(kind: str) -> _Events:
        return [one for one in events if one["kind"] == kind]

    ends = Counter(one["end"] for one in of("visit"))
    visits = sum(ends.values())
    yield Row("participants that came and went", visits, "", goal="some", met=visits > 0)
    yield Row("of them killed", ends["killed"], "")
    odd = len(of("broken")) + sum(
        count for end, count in ends.items() if end not in {"gone", "killed"}
    )
    yield Row("of these and their helpers failed", odd, "", goal="none", met=odd == 0)
    yield from _calls(of("call"))
    yield Row("clients that were never answered, twice", len(of("unanswered twice")), "")
    undiscovered = len(of("undiscovered"))
    yield Row("services not found in 30 s", undiscovered, "", goal="none", met=undiscovered == 0)
    seconds = max((one["seconds"] for one in of("run")), default=0.0)
    yield from _samples(of("samples"), len(of("unsaved")), seconds)
    silence = max((one["longest"] for one in of("diagnostics")), default=np.inf)
    goal, met = f"under {_SILENCE_LIMIT:g} s", silence < _SILENCE_LIMIT
    yield Row("longest silence on /diagnostics", silence, "s", goal=goal, met=met)
    yield from _endings(of("ending"))
    for one in of("node"):
        name = one["name"]
        yield Row(f"{name}: processor", one["cores"], "cores")
        yield Row(f"{name}: memory", one["memory"], "MB", one["early_memory"], "after a minute")
        yield Row(f"{name}: threads", one["threads"], "", one["early_threads"], "after a minute")
    ended = len(of("ended itself"))
    yield Row("nodes that ended themselves, frozen", ended, "", goal="none", met=ended == 0)
    died = len(of("died"))
    yield Row("nodes that died or hung", died, "", goal="none", met=died == 0)
    for one in of("shared memory"):
        yield Row("shared memory: files, most", one["files"], "")
        yield Row("shared memory in use, most", one["megabytes"], "MB")
