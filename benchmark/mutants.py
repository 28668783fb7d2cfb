# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the tests would not notice: python -m benchmark.mutants, or `make mutants`.

mutmut changes one operator, number, argument or word of a function at a time, and runs the tests of
its room against the change. A mutant survives if no test fails. Each room is mutated in a copy,
`build/mutants/<room>`, with its own tests only.

mutmut skips decorated functions. The copy unwraps properties, so they are mutated too. Compiled
kernels are not mutated: their tests take minutes without the compiler. Numbers of a module outside
its functions are not mutated either, since the tests derive their own.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mutmut.configuration import reset_config
from mutmut.mutation.diff_apply import get_diff_for_mutant
from mutmut.mutation.file_mutation import mutate_file_contents
from mutmut.utils.format_utils import get_mutant_name

PROJECT = Path(__file__).resolve().parents[1]
WORKSPACE = PROJECT / "build" / "mutants"
COPIED = ("valve_friction_ros", "test", "benchmark", "config")

# Time limit of a mutant: a multiple of the time of the tests that reach it, plus some seconds.
TIME_FACTOR, TIME_MORE = 4.0, 5.0

# The same example runs in several processes, and examples are not shrunk.
CONFTEST = """
from hypothesis import HealthCheck, Phase
settings.register_profile(
    "mutants",
    parent=settings.get_profile("project"),
    suppress_health_check=[HealthCheck.differing_executors],
    phases=[Phase.explicit, Phase.generate],
    database=None,
)
settings.load_profile("mutants")
"""

PROPERTY = re.compile(r"^    @(property|cached_property)\n    def (\w+)\(", re.MULTILINE)
KILLED = {1, 3, -24, 24, 152, 36, 255, -9, -11}
"""Exit codes: tests failed, or the mutant timed out or crashed."""


class Room(NamedTuple):
    """Folder of the code, and files or folders of its tests."""

    code: str
    tests: tuple[str, ...]


_IDENTIFICATION = "valve_friction_ros/identification"
_TESTS = "test/identification"
ROOMS = {
    "trust": Room(f"{_IDENTIFICATION}/trust", (f"{_TESTS}/trust", f"{_TESTS}/test_refusals.py")),
    "engine": Room(f"{_IDENTIFICATION}/engine", (f"{_TESTS}/engine",)),
    "published": Room(f"{_IDENTIFICATION}/published", (f"{_TESTS}/published",)),
    "health": Room("valve_friction_ros/health", ("test/health",)),
}


def say(text: str) -> None:
    """Print a line immediately."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def unwrapped(source: str) -> str:
    """Rewrite each property of a module as a method and a property made from it."""
    pieces, end = [], 0
    for match in PROPERTY.finditer(source):
        kind, name = match.groups()
        after = re.compile(r"^(?=    @|    def |    \w|\S)", re.MULTILINE)
        body = after.search(source, match.end())
        stop = body.start() if body else len(source)
        pieces.append(source[end : match.start()])
        pieces.append(f"    def of_{name}(" + source[match.end() : stop].rstrip("\n"))
        pieces.append(f"\n\n    {name} = {kind}(of_{name})\n\n")
        end = stop
    return "".join(pieces) + source[end:]


def prepare(name: str, slow: bool) -> Path:
    """Copy the project for a room, with the room's settings of mutmut."""
    room, place = ROOMS[name], WORKSPACE / name
    shutil.rmtree(place, ignore_errors=True)
    for part in COPIED:
        shutil.copytree(PROJECT / part, place / part)
    for path in (place / room.code).glob("*.py"):
        path.write_text(unwrapped(path.read_text()))
    with (place / "test/conftest.py").open("a") as conftest:
        conftest.write(CONFTEST)
    marks = [] if slow else ["-m", "not slow"]
    settings = {
        "source_paths": [room.code],
        "also_copy": list(COPIED),
        "pytest_add_cli_args_test_selection": list(room.tests),
        "pytest_add_cli_args": ["-p", "no:cacheprovider", "-p", "no:xdist", *marks],
        "timeout_multiplier": TIME_FACTOR,
        "timeout_constant": TIME_MORE,
        "use_git_change_detection": False,
    }
    # Strings, numbers, lists and booleans are the same in JSON and TOML.
    lines = [f"{key} = {json.dumps(value)}" for key, value in settings.items()]
    shown = (PROJECT / "pyproject.toml").read_text()
    (place / "pyproject.toml").write_text("\n".join([shown, "[tool.mutmut]", *lines, ""]))
    return place


def mutant_names(room: Room) -> list[str]:
    """Return the names of all mutants of a room; the working directory is its copy."""
    names = []
    for path in sorted(Path(room.code).glob("*.py")):
        found = mutate_file_contents(str(path), path.read_text(), None, None).mutant_names
        names += [get_mutant_name(path, name) for name in found]
    return names


def outcomes(room: Room, chosen: set[str]) -> Iterator[tuple[Path, Mapping[str, int]]]:
    """Yield the exit codes of the chosen mutants, file by file."""
    for path in sorted(Path(room.code).glob("*.py")):
        meta = Path("mutants") / f"{path}.meta"
        codes = json.loads(meta.read_text())["exit_code_by_key"] if meta.exists() else {}
        yield path, {name: code for name, code in codes.items() if name in chosen}


def survivors_of(name: str) -> Path:
    """Return the file with the survivors of the last run of a room."""
    return WORKSPACE / f"{name}-survivors.txt"


def report(name: str, chosen: set[str]) -> Counter[str]:
    """Print the number of killed mutants per file, and the changes of the survivors."""
    total: Counter[str] = Counter()
    survivors: list[tuple[str, Path]] = []
    say(f"\n{'killed':>8} {'of':>5}   file")
    for path, codes in outcomes(ROOMS[name], chosen):
        if codes:
            alive = [mutant for mutant, code in codes.items() if code not in KILLED]
            survivors += [(mutant, path) for mutant in alive]
            say(f"{len(codes) - len(alive):>8} {len(codes):>5}   {path}")
            total += Counter(killed=len(codes) - len(alive), tried=len(codes))
    survivors_of(name).write_text("".join(f"{mutant}\n" for mutant, _ in survivors))
    for mutant, path in survivors:
        changed = [
            line
            for line in get_diff_for_mutant(mutant, path=path).splitlines()
            if line[:1] in "+-" and not line.startswith(("+++", "---"))
        ]
        say("\n" + "\n".join([f"survived: {mutant}", *changed]))
    return total


def run(name: str, arguments: argparse.Namespace) -> Counter[str]:
    """Test all mutants of a room, or a sample."""
    os.chdir(prepare(name, arguments.slow))
    reset_config()
    names = [one for one in mutant_names(ROOMS[name]) if arguments.only in one]
    if arguments.again:
        names = [one for one in names if one in survivors_of(name).read_text().split()]
    if arguments.sample is not None and arguments.sample < len(names):
        draw = np.random.default_rng(arguments.seed).choice
        names = [str(one) for one in draw(names, arguments.sample, replace=False)]
    say(f"\n{name}: {len(names)} mutants")
    program = str(Path(sys.executable).parent / "mutmut")
    command = [program, "run", "--max-children", str(arguments.jobs), *names]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    log = WORKSPACE / f"{name}.log"
    with log.open("w") as output:
        done = subprocess.run(command, stdout=output, stderr=output, env=environment, check=False)
    if done.returncode != 0:
        sys.exit(f"mutmut failed, the reason is in {log}")
    return report(name, set(names))


def main() -> None:
    """Run the requested rooms."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__.splitlines()[0])
    parser.add_argument("--room", choices=ROOMS, action="append", help="default: all")
    parser.add_argument("--only", default="", help="mutants whose names contain this, as a file's")
    parser.add_argument("--sample", type=int, help="number of mutants a room, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--again", action="store_true", help="what survived the last run only")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    parser.add_argument("--slow", action="store_true", help="with the tests marked as slow")
    arguments = parser.parse_args()
    for name in arguments.room or ROOMS:
        total = run(name, arguments)
        share = total["killed"] / max(total["tried"], 1)
        say(f"\n{name}: {total['killed']} of {total['tried']} killed, {100 * share:.0f} %")


if __name__ == "__main__":
    main()
