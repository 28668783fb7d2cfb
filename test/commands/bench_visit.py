# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a client of the bench is told when things go wrong, printed as one JSON object."""

import json
import os
import sys

from valve_friction_ros.commands.demo.bench import (
    NodeProcess,
    bench_client,
    quick_discovery,
    running_nodes,
)
from valve_friction_ros.health import Level
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import RecordBuffer

NODES = [NodeProcess("identifier", {"input_timeout": 0.5}), NodeProcess("simulator", {})]


def error_of(call, *arguments):
    try:
        call(*arguments)
    except RefusalError as error:
        return str(error)
    return None


def visit(client):
    """Call everything that must fail while no pressure is published."""

    def set_parameters(values):
        return error_of(client.set_parameters, "/fv_7/simulator", values, 10.0)

    seen = {
        "before": [client.recorded, client.status, client.diagnostic_values],
        "identify": error_of(client.trigger, "identify"),
        "clear": client.trigger("clear"),
        "impossible": set_parameters({"coulomb_friction": 1e6}),
        "possible": set_parameters({"coulomb_friction": 700.0, "static_friction": 800.0}),
    }
    client.wait(lambda: client.status and client.status.level[0] == Level.WARN, 30.0, "warning")
    return seen | {
        "message": client.status.message,
        "estimate_valid": client.diagnostic_values["estimate_valid"],
    }


if __name__ == "__main__":
    os.environ.update(quick_discovery())
    buffer = RecordBuffer(BENCH_VALVE, 1.0)
    with running_nodes(NODES, "fv_7") as processes, bench_client("fv_7", buffer) as client:
        answers = visit(client)
    answers["exit codes"] = [process.returncode for process in processes]
    json.dump(answers, sys.stdout)
