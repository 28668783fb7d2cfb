# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A timed run in a private domain: options, ledger, evaluation, and a participant."""

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

BENCH = Path(__file__).resolve().parents[2] / "config" / "bench_low.yaml"
Events = Sequence[Mapping[str, Any]]


class Ledger:
    """A file of events as lines of JSON, each with a kind and further keys.

    Many processes may append to it. Each line is written in one call, so that a process may be
    killed at any time.
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
    """Group events by kind; a kind that did not occur gives an empty list."""
    found = defaultdict[str, list[Mapping[str, Any]]](list)
    for one in events:
        found[one["kind"]].append(one)
    return found


@contextlib.contextmanager
def quiet_domain() -> Iterator[int]:
    """Provide a domain that nobody else on this machine uses."""
    with free_domain() as domain:
        os.environ |= {
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "RCUTILS_COLORIZED_OUTPUT": "0",
        }
        yield domain


def own_folder(name: str, wanted: Path | None) -> Path:
    """Return the requested folder, or a new folder."""
    folder = wanted or Path(tempfile.mkdtemp(prefix=f"{name}_"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def run_parser(name: str, text: str | None) -> argparse.ArgumentParser:
    """Return a parser with the options for length, seed and folder."""
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
    """Run `live` and print its rows; return 1 if a goal is missed.

    `live` receives the options with a seed and a folder, the length, s, and the ledger.
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
    """A node that hears others while it spins, and leaves at the end of its `with` block.

    `domain` is its ROS domain; None for that of the environment. The options are those of a node.
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
        """Leave cleanly."""
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def wait(self, is_met: Callable[[], bool], limit: float) -> bool:
        """Listen until a condition is met; return whether it was met within a limit, s."""
        end = time.monotonic() + limit
        while not is_met():
            if time.monotonic() > end:
                return False
            self.spin(0.05)
        return True

    def answer(self, call: Any, limit: float) -> Any:
        """Listen until a call is answered; return the answer, or None after the limit."""
        self._executor.spin_until_future_complete(call, limit)
        return call.result() if call.done() else None
