# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A run of some length in a domain of its own: its options, its ledger, its account."""

import argparse
import random
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from rich.console import Console

from benchmark.churn.domain import quiet_domain
from benchmark.churn.ledger import Ledger
from benchmark.speed.rows import Row
from benchmark.speed.table import machine_shape, rows_table

__all__ = ["add_run_arguments", "endured"]

_WIDTH_OF_A_FILE = 120


def add_run_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare how long, by which chance and where."""
    parser.add_argument("--minutes", type=float, default=60.0, help="how long (%(default)g)")
    parser.add_argument("--seed", type=int, help="of all chance; default: drawn, and printed")
    parser.add_argument("--folder", type=Path, help="of ledger and logs; default: a new one")


def endured(
    name: str,
    title: str,
    options: argparse.Namespace,
    live: Callable[[Path, float, int, Ledger], Iterable[Row]],
) -> int:
    """Let `live` run, and print the rows that it returns; return 1 if a goal is missed.

    It is given the folder, the length (s), the seed and the ledger.
    """
    seed = random.SystemRandom().randrange(2**31) if options.seed is None else options.seed
    folder = options.folder or Path(tempfile.mkdtemp(prefix=f"{name}_"))
    folder.mkdir(parents=True, exist_ok=True)
    console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)
    console.print(", ".join(f"{key} {value}" for key, value in machine_shape().items()))
    with quiet_domain() as domain:
        console.print(f"seed {seed}, domain {domain}, ledger and logs in {folder}", soft_wrap=True)
        ledger = Ledger(folder / "ledger.jsonl")
        found = list(live(folder, 60 * options.minutes, seed, ledger))
    console.print(rows_table(title, found))
    missed = [row for row in found if row.met is False]
    for row in missed:
        console.print(f"[red]missed[/] {row.item}: {row.goal}", soft_wrap=True)
    return 1 if missed else 0
