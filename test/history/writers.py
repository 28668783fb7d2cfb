# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Processes that write to a history until they are killed, and say what they have finished.

The first argument names what is written; the others are those of the function.
"""

import os
import signal
import subprocess
import sys
import time
from itertools import count
from pathlib import Path

HERE = Path(__file__).resolve()


def writer(what, *arguments):
    """Start a process that writes; it says each step on a line."""
    return subprocess.Popen(
        [sys.executable, HERE, what, *map(str, arguments)], stdout=subprocess.PIPE, text=True
    )


def say(*words):
    print(*words, flush=True)  # noqa: T201 - to the test


def history(path, number, rows=""):
    """Add identifications and baselines of a valve."""
    # Ten that write without a pause leave one of them waiting for long on a busy machine.
    database._PATIENCE = 60.0
    file = HistoryFile(Path(path))
    valve = VALVE._replace(name=f"/fv_{number}/identifier")
    for k in range(int(rows)) if rows else count():
        if k % 5 == 4:
            file.add(refused(START + k, valve=valve))
        else:
            file.add(success(START + k, 100.0 + k, valve=valve))
        file.set_baseline(valve, KeptBaseline(Baseline(100.0 + k), START + k, START + k))
        say(k)


def alarms(path, who, killed_at=-1):
    """Move the alarms of a valve on, step by step.

    Given a number, it kills itself within the transaction of that step: after the rows are written,
    and before they are the file's.
    """
    put, written, killed_at = alarm_rows.put, [0], int(killed_at)

    def put_and_die(*given, **named):
        put(*given, **named)
        if written[0] == killed_at:
            os.kill(os.getpid(), signal.SIGKILL)

    alarm_rows.put = put_and_die
    file, kind = HistoryFile(Path(path)), AlarmKind.FRICTION_HIGH
    steps = (
        Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown"),
        AlarmAction.ACKNOWLEDGE,
        Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction"),
        AlarmAction.COMMENT,
        AlarmAction.SHELVE,
        AlarmAction.UNSHELVE,
        AlarmAction.TAKE_OUT,
        AlarmAction.PUT_BACK,
        Condition(),
        AlarmAction.ACKNOWLEDGE,
    )
    for number in count() if killed_at < 0 else range(len(steps)):
        step, now = steps[number % len(steps)], START + number * SECOND
        written[0] = number
        try:
            if isinstance(step, Condition):
                follow_alarms(file, VALVE, {kind: step}, now)
            else:
                request = AlarmRequest(step, who, f"step {number}", 3600.0)
                request_alarms(file, VALVE, kind, request, now)
        except AlarmError:  # another process has done it
            continue
        say(step.name if isinstance(step, AlarmAction) else "valve", number)


def sent(folder, server, most, *places):
    """Write to histories and send them; each FILE=NUMBER of a valve has a process of its own."""
    # So that a run of seconds has many instants of each kind.
    outbox._PAUSE, outbox._MANY = 0.01, 10
    first, *others = (one.partition("=") for one in places)
    children = []
    for name, _, number in others:
        if not (child := os.fork()):
            send(Path(folder, name), server, number, int(most))
            os._exit(0)
        children.append(child)
    send(Path(folder, first[0]), server, first[2], int(most))
    sys.exit(any(os.waitpid(child, 0)[1] for child in children))


def send(path, server, number, most):
    file, valve = HistoryFile(path), VALVE._replace(name=f"/fv_{number}/identifier")
    sender = sender_of(path, HistoryServer(server))
    for k in range(most):
        file.add((refused if k % 5 == 4 else success)(START + k, valve=valve))
        if k % 10 == 0:
            file.set_baseline(valve, KeptBaseline(Baseline(100.0 + k), START + k, START + k))
            keep_told_level(file, valve, Level(k % 3))
        say(k)
    outbox.follow(path)  # before the sender has done so, nothing is counted
    while outbox.count_unsent(path).waiting:
        time.sleep(0.02)
    sender.end()


if __name__ == "__main__":
    sys.path[:0] = [str(HERE.parents[1] / "support"), str(HERE.parents[2])]

    from histories import SECOND, START, VALVE, refused, success

    from valve_friction_ros.health import (
        AlarmAction,
        AlarmError,
        AlarmKind,
        AlarmRequest,
        Baseline,
        Condition,
        Level,
        StatusSignal,
    )
    from valve_friction_ros.history import (
        HistoryFile,
        HistoryServer,
        KeptBaseline,
        alarm_rows,
        database,
        follow_alarms,
        keep_told_level,
        outbox,
        request_alarms,
        sender_of,
    )

    {"history": history, "alarms": alarms, "sent": sent}[sys.argv[1]](*sys.argv[2:])
