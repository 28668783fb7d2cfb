# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Entries of a history, made up."""

import math
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    FrictionLimits,
    FrictionState,
    Level,
    MonitorSettings,
    SlidingFriction,
    StatusSignal,
    compared,
)
from valve_friction_ros.health.diagnosis import friction_state
from valve_friction_ros.history import HistoryEntry, HistoryFile, KeptBaseline, KeptValve
from valve_friction_ros.history.entry import Fit, Span, settings_text
from valve_friction_ros.history.rows import state_columns
from valve_friction_ros.identification import Parameter, Verdict
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.wording import quoted

SECOND = 1_000_000_000
DAY = 86_400 * SECOND
START = 1_790_000_000 * SECOND
"""2026-09-21 14:13:20 UTC."""
VALVE = KeptValve("/fv_101/identifier", "FV-101")
OTHER = KeptValve("/area_2/lv_7/identifier", "LV-7")
_SETTINGS = settings_text(MonitorSettings(BENCH_VALVE))


def as_kept(one):
    """The parameter as the history gives it back: without its bound."""
    return replace(one, withheld=(math.nan, math.nan))


def parameter(name, value, half_width=1.0, verdict=Verdict.IDENTIFIED, reason=""):
    return Parameter(name, value, half_width / 2, half_width, verdict, reason)


def _entry(time, valve, words, changes, *diagnosed):
    """An entry of the bench method, with what is the same of a success and a refusal."""
    return HistoryEntry(
        **{
            "time": time,
            "valve": valve,
            "span": None,
            "method": "bench",
            "diagnosis": Diagnosis(Level.OK, StatusSignal.GOOD, quoted(words), *diagnosed),
            "limits": FrictionLimits(),
            "baseline": None,
            "settings": _SETTINGS,
            **changes,
        }
    )


def success(time=START, friction=150.0, half_width=3.0, valve=VALVE, **changes):
    """An identification of a Coulomb friction, and of a sliding friction where one is given.

    The rest of its parameters are always the same.
    """
    verdict = changes.pop("verdict", Verdict.IDENTIFIED)
    baseline = changes.get("baseline")
    one = parameter("coulomb_friction", friction, half_width, verdict)
    frictions, slid = {one.name: one}, changes.pop("sliding", None)
    if slid is not None:
        name = "sliding_friction"
        frictions[name] = parameter(name, slid.value, slid.half_width, verdict)
        changes["sliding_speed"] = slid.speed
    speed = changes.get("sliding_speed", math.nan)
    found = None if baseline is None else compared(frictions, speed, baseline)
    state = friction_state(found.ratio, FrictionLimits()) if found else FrictionState.UNKNOWN
    withheld = (math.nan, math.nan, Verdict.NOT_IDENTIFIABLE, "no slip jump")
    parameters = {
        "mass": parameter("mass", 1.0, 0.0, Verdict.FIXED, "assumed"),
        "coulomb_friction": one,
        "static_friction": parameter("static_friction", *withheld),
        **frictions,
    }
    known = {"span": Span(time - 60 * SECOND, time), "parameters": parameters}
    known |= {"fit": Fit(0.99, 1e-5, 1e-6), **changes}
    return _entry(time, valve, "friction normal: so", known, found and found.ratio, state)


def refused(time=START, reason="the stem does not move: move the valve", valve=VALVE, **changes):
    return _entry(time, valve, f"no estimate: {reason}", {"refusal": reason, **changes}, None)


_OF_VERSION_5 = {"valve", "settings", "identification", "parameter", "baseline", "baseline_record"}


def select(history, query):
    """The rows that plain SQL finds in the file."""
    with closing(sqlite3.connect(history.path)) as connection:
        return connection.execute(query).fetchall()


def change(history, script):
    """Change the file by plain SQL, whatever its checks say."""
    with closing(sqlite3.connect(history.path)) as connection:
        connection.executescript(f"PRAGMA ignore_check_constraints = ON; {script}")


_SINCE_VERSION_6 = (
    "DROP INDEX identification_uid; ALTER TABLE identification DROP COLUMN uid; "
    "DROP INDEX baseline_uid; ALTER TABLE baseline DROP COLUMN uid; "
    "DROP TABLE keeper; DROP TABLE mark; PRAGMA user_version = 6"
)
"""Takes from a file of version 7 all by which its dump differs from that of version 6."""


def make_version(version, history):
    """Fill a new file with what that version has dumped of its own."""
    history.path.parent.mkdir(parents=True, exist_ok=True)
    name = f"history_of_version_{7 if version == 6 else version}.sql"
    change(history, (Path(__file__).parents[1] / "history" / name).read_text())
    if version == 6:
        change(history, _SINCE_VERSION_6)
    return history


def make_version_5(history):
    """Take away what later versions know: the valve in service, other files, typed states."""
    columns = state_columns(Diagnosis(Level.OK, StatusSignal.GOOD, quoted(""), None))
    script = [f"ALTER TABLE identification DROP COLUMN {column}" for column in columns]
    for table in ("identification", "baseline"):
        script += [f"DROP INDEX {table}_uid", f"ALTER TABLE {table} DROP COLUMN uid"]
    tables = select(history, "SELECT name FROM sqlite_master WHERE type = 'table'")
    script += [f"DROP TABLE {name}" for (name,) in tables if name not in _OF_VERSION_5]
    change(history, f"{'; '.join(script)}; PRAGMA user_version = 5")


def at_other_speeds(path):
    """A history of four weeks in which friction grows, the last three at far higher speeds."""
    file = HistoryFile(path)
    healthy = Baseline(sliding=SlidingFriction(300.0, 5.0, 0.8e-3))
    file.set_baseline(VALVE, KeptBaseline(healthy, START + 1, START))
    for week, (force, speed) in enumerate(((300, 0.8), (350, 6.0), (430, 8.0), (550, 9.0))):
        slid = SlidingFriction(force, 5.0, speed * 1e-3)
        file.add(success(START + week * 7 * DAY, sliding=slid, baseline=healthy))
    return file
