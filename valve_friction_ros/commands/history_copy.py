# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `history copy`: copy a history to another file or server, and compare the two."""

import argparse
import json

from valve_friction_ros.commands.arguments.identification import chosen_valves
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.history import CopiedPart, History, copied


def _print_table(parts: tuple[CopiedPart, ...]) -> None:
    print(f"{'table':<20}{'rows':>10}{'written':>10}{'same':>10}  checksum")
    for one in parts:
        verdict = one.checksum[:12] if one.is_same else f"{one.checksum[:12]} ≠ {one.copied[:12]}"
        print(f"{one.table:<20}{one.rows:>10}{one.written:>10}{one.same:>10}  {verdict}")


def run(options: argparse.Namespace) -> int:
    """Copy the history, and print the result table by table."""
    valves = History(options.source).valves()
    names = [one.name for one in chosen_valves(valves, options.valve, "--valve")]
    parts = copied(options.source, options.target, names)
    is_same = all(one.is_same for one in parts)
    if options.json:
        tables = {one.table: {**one._asdict(), "is_same": one.is_same} for one in parts}
        print(json.dumps({"valves": names, "tables": tables, "is_same": is_same}))
    else:
        _print_table(parts)
        words = "all rows are the same" if is_same else "rows differ"
        print(f"{len(names)} valves: {words} in {options.source} and {options.target}")
    return ExitCode.DONE if is_same else ExitCode.PARTLY
