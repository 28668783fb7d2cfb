# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A process that moves the alarms of a valve on, step by step, until it is killed.

It says what it has finished, one line a step. Given a number, it kills itself within the
transaction of that step: after the rows are written, and before they are the file's.
"""

import os
import signal
import sys
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

if __name__ == "__main__":
    from histories import SECOND, START, VALVE

    from valve_friction_ros.health import (
        AlarmAction,
        AlarmError,
        AlarmKind,
        AlarmRequest,
        Condition,
        Level,
        StatusSignal,
    )
    from valve_friction_ros.history import (
        HistoryFile,
        alarm_rows,
        follow_alarms,
        request_alarms,
    )

    history, who = HistoryFile(Path(sys.argv[1])), sys.argv[2]
    killed_at = int(sys.argv[3]) if len(sys.argv) > 3 else -1
    put, written = alarm_rows.put, [0]

    def put_and_die(*given, **named):
        put(*given, **named)
        if written[0] == killed_at:
            os.kill(os.getpid(), signal.SIGKILL)

    alarm_rows.put = put_and_die
    warn = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
    error = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
    hour = 3600.0
    kind = AlarmKind.FRICTION_HIGH
    steps = (
        warn,
        AlarmAction.ACKNOWLEDGE,
        error,
        AlarmAction.COMMENT,
        AlarmAction.SHELVE,
        AlarmAction.UNSHELVE,
        AlarmAction.TAKE_OUT,
        AlarmAction.PUT_BACK,
        Condition(),
        AlarmAction.ACKNOWLEDGE,
    )
    for number in count() if killed_at < 0 else range(len(steps)):
        step, time = steps[number % len(steps)], START + number * SECOND
        written[0] = number
        try:
            if isinstance(step, Condition):
                follow_alarms(history, VALVE, {kind: step}, time)
            else:
                request_alarms(
                    history, VALVE, kind, AlarmRequest(step, who, f"step {number}", hour), time
                )
        except AlarmError:  # another process has done it
            continue
        sys.stdout.write(f"{step.name if isinstance(step, AlarmAction) else 'valve'} {number}\n")
        sys.stdout.flush()
