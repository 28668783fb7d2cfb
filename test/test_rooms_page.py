# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page that draws the rooms: it names every room, and every file that it names is there."""

import re
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[1]
SOURCES = PROJECT / "valve_friction_ros"
PAGE = (PROJECT / "doc" / "rooms.md").read_text(encoding="utf-8")
DRAWING, REST = PAGE.split("## Each room in one line")
TABLE, PLACES = REST.split("## Where is …")


def rooms(depth):
    found = SOURCES.glob("/".join(["*"] * depth) + "/__init__.py")
    return {path.parent.relative_to(SOURCES).as_posix() for path in found}


def rooms_of_one_file():
    """Names that the page gives as a single file, and that are one."""
    named = [cell.strip("`") for cell in first_cells(TABLE)]
    return {name for name in named if (SOURCES / name).is_file()}


def first_cells(text):
    return [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| `")]


def test_every_room_has_one_line():
    named = [cell.strip("`/") for cell in first_cells(TABLE)]
    assert sorted(named) == sorted(rooms(1) | rooms(2) | rooms_of_one_file())


@pytest.mark.parametrize("room", sorted(rooms(1)))
def test_every_room_is_drawn(room):
    assert re.search(rf"\b{room}\b", DRAWING)


@pytest.mark.parametrize("inner", ["trust", "published", "engine", "signature", "steps"])
def test_the_rooms_of_identification_are_drawn(inner):
    assert re.search(rf"\b{inner}\b", DRAWING)


def test_every_named_file_is_there():
    named = re.findall(r"`([a-z_/]+\.py)`", PLACES)
    assert len(named) > 20
    missing = [
        name for name in named if not any((home / name).is_file() for home in (SOURCES, PROJECT))
    ]
    assert not missing


@pytest.mark.parametrize("equation", range(1, 21))
def test_every_equation_has_a_place(equation):
    """(14) stands in a line as itself, or within a range such as (11) to (13)."""
    cells = [line.split("|")[1] for line in PLACES.splitlines() if line.startswith("| (")]
    covered = set()
    for cell in cells:
        for first, last in re.findall(r"\((\d+)\) to \((\d+)\)", cell):
            covered |= set(range(int(first), int(last) + 1))
        covered |= {int(number) for number in re.findall(r"\((\d+)\)", cell)}
    assert equation in covered
