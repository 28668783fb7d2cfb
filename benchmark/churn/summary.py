# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The events of a run as rows with goals."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from benchmark.churn.visitor import ANSWER_LIMIT, process_of
from benchmark.harness.processes import CODES
from benchmark.harness.rows import Row, none, some, under
from benchmark.harness.run import Events, by_kind

_END_LIMIT = 3.0
"""Longest time for a node to end after a signal, s."""
_SILENCE_LIMIT = 5.0
_LOOKED_AT, _LATE = 0.95, 60.0
"""Share of the stream to examine, and time excluded at its ends, s."""


def hung_services(events: Events, until: float = math.inf) -> list[str]:
    """Return unanswered services whose process has answered no other client meanwhile.

    Only services reported before `until`, s since 1970, are included. A single client may lose its
    answers; a hung node answers none.
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


def _calls(calls: Events) -> Iterator[Row]:
    yield some("calls of services and parameters", len(calls))
    by_name: dict[str, list[float]] = {}
    for one in calls:
        name = one["service"].rpartition("/")[2]
        by_name.setdefault(name, []).append(one["seconds"] or np.inf)
    for name, times in sorted(by_name.items()):
        yield Row(f"  {name} ({len(times)}): longest answer", max(times), "s")
    answered = [one["seconds"] for one in calls if one["seconds"] is not None]
    if answered:
        yield Row("median answer", float(np.median(answered)), "s")
        yield Row("answer of 99 in 100", float(np.quantile(answered, 0.99)), "s")
    late = sum(time > ANSWER_LIMIT for time in answered)
    yield none(f"answered after more than {ANSWER_LIMIT:g} s", late)
    yield none("never answered", len(calls) - len(answered))


def _samples(bags: Events, unsaved: int, seconds: float) -> Iterator[Row]:
    holes, covered = 0, 0.0
    for topic in sorted({one["topic"] for one in bags}):
        mine = [one for one in bags if one["topic"] == topic and one["count"]]
        covered += mine[0]["last"] - mine[0]["first"] if mine else 0
        for earlier, later in itertools.pairwise(mine):
            covered += later["last"] - max(earlier["last"], later["first"])
            holes += later["first"] > earlier["last"]
    least = 2 * _LOOKED_AT * (seconds - _LATE)
    goal, met = f"at least {least:.0f} s", covered / 1e9 >= least
    yield Row("stream looked at, both signals", covered / 1e9, "s", goal=goal, met=met)
    yield none("samples lost", sum(one["missing"] for one in bags))
    yield none("times at which the look came too late", holes + unsaved)


def _endings(endings: Events) -> Iterator[Row]:
    yield some("nodes ended by SIGINT or SIGTERM", len(endings))
    times = [one["seconds"] for one in endings if one["seconds"] is not None]
    if times:
        yield Row("longest time to their end", max(times), "s")
    bad = sum(one["seconds"] is None or one["seconds"] > _END_LIMIT for one in endings)
    yield none(f"ended after more than {_END_LIMIT:g} s", bad)
    early = sum(one["code"] in CODES[1:] for one in endings)
    yield Row("ended by the signal itself, before Python ran", early)
    yield none("ended with another code", sum(one["code"] not in CODES for one in endings))


def rows(events: Events) -> Iterator[Row]:
    """Count the events, and compare them with the goals."""
    of = by_kind(events)
    ends = Counter(one["end"] for one in of["visit"])
    visits = sum(ends.values())
    yield some("participants that came and went", visits)
    yield Row("of them killed", ends["killed"])
    odd = len(of["broken"]) + visits - ends["gone"] - ends["killed"]
    yield none("of these and their helpers failed", odd)
    yield from _calls(of["call"])
    yield Row("clients that were never answered, twice", len(of["unanswered twice"]))
    yield none("services not found in 30 s", len(of["undiscovered"]))
    seconds = max((one["seconds"] for one in of["run"]), default=0.0)
    yield from _samples(of["samples"], len(of["unsaved"]), seconds)
    silence = max((one["longest"] for one in of["diagnostics"]), default=np.inf)
    yield under("longest silence on /diagnostics", silence, "s", _SILENCE_LIMIT)
    yield from _endings(of["ending"])
    for one in of["node"]:
        name = one["name"]
        yield Row(f"{name}: processor", one["cores"], "cores")
        yield Row(f"{name}: memory", one["memory"], "MB", one["early_memory"], "after a minute")
        yield Row(f"{name}: threads", one["threads"], "", one["early_threads"], "after a minute")
    yield none("nodes that ended themselves, frozen", len(of["ended itself"]))
    yield none("nodes that died or hung", len(of["died"]))
    for one in of["shared memory"]:
        yield Row("shared memory: files, most", one["files"])
        yield Row("shared memory in use, most", one["megabytes"], "MB")
