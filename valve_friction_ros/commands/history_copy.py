"""Sub-command `history copy`: copy a history to another file or server, and compare the two."""

import argparse
import json

from valve_friction_ros.commands.arguments.history_place import PLACE, history_place
from valve_friction_ros.commands.arguments.kept_valves import add_valve_argument, chosen_valves
from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.history import CopiedPart, History, HistoryError, copied

__all__ = ["REFUSALS", "declare", "run"]

REFUSALS = (HistoryError,)


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments, and what the help says around them."""
    parser.description = (
        "Copy a history: from a file to a PostgreSQL server, back, or between two of a kind. Only "
        "what the other one lacks, or has otherwise, is written, so a copy that was interrupted is "
        "called again. Then all rows are compared, by count and checksum."
    )
    parser.epilog = (
        "The address of a server is postgresql://user@host/database; its password belongs into "
        "~/.pgpass or PGPASSWORD. Exit code 1: rows differ, as the other one has kept them "
        "otherwise; 2: one of the two cannot be read or written."
    )
    parser.add_argument(
        "source", type=history_place, metavar="FROM", help=f"the history that is copied, {PLACE}"
    )
    parser.add_argument(
        "target", type=history_place, metavar="TO", help="where to; it is made if it is missing"
    )
    add_valve_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _print_table(parts: tuple[CopiedPart, ...]) -> None:
    print(f"{'table':<20}{'rows':>10}{'written':>10}{'same':>10}  checksum")
    for one in parts:
        verdict = one.checksum[:12] if one.is_same else f"{one.checksum[:12]} ≠ {one.copied[:12]}"
        print(f"{one.table:<20}{one.rows:>10}{one.written:>10}{one.same:>10}  {verdict}")


def run(options: argparse.Namespace) -> int:
    """Copy, and print what was copied, table by table."""
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
