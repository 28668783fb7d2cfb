# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A run of some length in a domain of its own: options, ledger, account, and a participant."""

import argparse
import contextlib
import json
import os
import random
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor

from benchmark.harness.rows import Row, judged, opened_console, rows_table
from valve_friction_ros.commands.demo.bench import free_domain

Events = Sequence[Mapping[str, Any]]


class Ledger:
    """What happened, as lines of JSON: a file of events, each a kind and what is known of it.

    Many processes may append to it. A line is written at once, so that a process may be killed at
    any time.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        path.touch()

    def add(self, kind: str, **known: Any) -> None:
        """Append an event."""
        line = json.dumps({"kind": kind, "time": time.time(), **known}, ensure_ascii=False) + "\n"
        with self.path.open("ab", buffering=0) as stream:
            os.write(stream.fileno(), line.encode())

    def events(self) -> list[Mapping[str, Any]]:
        """Return all events, oldest first."""
        with self.path.open(encoding="utf-8") as stream:
            return list(map(json.loads, stream))


def by_kind(events: Events) -> Mapping[str, Events]:
    """Sort events by their kind; none of a kind that did not happen."""
    found = defaultdict[str, list[Mapping[str, Any]]](list)
    for one in events:
        found[one["kind"]].append(one)
    return found


@contextlib.contextmanager
def quiet_domain() -> Iterator[int]:
    """Provide a domain of this machine that nobody else uses."""
    with free_domain() as domain:
        os.environ |= {
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "RCUTILS_COLORIZED_OUTPUT": "0",
        }
        yield domain


def own_folder(name: str, wanted: Path | None) -> Path:
    """Return the folder that was wanted, or a new one."""
    folder = wanted or Path(tempfile.mkdtemp(prefix=f"{name}_"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def run_parser(name: str, text: str | None) -> argparse.ArgumentParser:
    """Return a parser that asks how long, by which chance and where."""
    parser = argparse.ArgumentParser(prog=name, description=text)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long (%(default)g)")
    parser.add_argument("--seed", type=int, help="of all chance; default: drawn, and printed")
    parser.add_argument("--folder", type=Path, help="of ledger and logs; default: a new one")
    return parser


def endured(
    title: str,
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    live: Callable[[argparse.Namespace, float, Ledger], Iterable[Row]],
) -> int:
    """Let `live` run, and print the rows that it returns; return 1 if a goal is missed.

    It is given the options, with a seed and a folder, the length (s) and the ledger.
    """
    options = parser.parse_args(arguments)
    if options.seed is None:
        options.seed = random.SystemRandom().randrange(2**31)
    folder = options.folder = own_folder(parser.prog, options.folder)
    console = opened_console()
    with quiet_domain() as domain:
        told = f"seed {options.seed}, domain {domain}, ledger and logs in {folder}"
        console.print(told, soft_wrap=True)
        ledger = Ledger(folder / "ledger.jsonl")
        found = list(live(options, 60 * options.minutes, ledger))
    console.print(rows_table(title.format(f"{options.minutes:g} minutes"), found))
    return judged(found, console)


class Participant(contextlib.AbstractContextManager["Participant"]):
    """A node that hears others while it is spun; it leaves where the `with` of it ends.

    Parameters
    ----------
    name : str
        Name of the node.
    domain : int or None
        Its domain; None: that of the environment.
    options
        Further ones of a node.
    """

    def __init__(self, name: str, domain: int | None = None, **options: Any) -> None:
        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context, domain_id=domain)
        self.node = rclpy.create_node(name, context=self.context, enable_rosout=False, **options)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave politely."""
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def wait(self, is_met: Callable[[], bool], limit: float) -> bool:
        """Listen until something is so; return whether it came so within a limit, s."""
        end = time.monotonic() + limit
        while not is_met():
            if time.monotonic() > end:
                return False
            self.spin(0.05)
        return True

    def answer(self, call: Any, limit: float) -> Any:
        """Listen until a call is answered; return its answer, None if none came in time."""
        self._executor.spin_until_future_complete(call, limit)
        return call.result() if call.done() else None
