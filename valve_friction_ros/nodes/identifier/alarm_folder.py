# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The folder of alarm recordings: their names, and how many of them stay."""

import re
import shutil
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from valve_friction_ros.health import Level
from valve_friction_ros.streams import utc

PAGE = "report.html"
"""The page of the report, in the folder of the bag."""

_DESCRIPTION = "metadata.yaml"
"""The file that makes a folder a bag."""
_BESIDE = re.compile(rf"valve\.yaml|(\.\d+_)?{re.escape(PAGE)}")
"""Files beside the bag, and the draft of a page."""
_STALE = 86_400.0
"""Age, s, from which an unfinished bag is what a killed node has left."""


def recording_name(valve: str, stamp: int, level: Level) -> str:
    """Name the recording of a valve whose level has risen at a time, ns."""
    date = utc(stamp)
    return f"alarm_{valve}_{date:%Y%m%dT%H%M%SZ}_{level.name}"


def size_of(recording: Path) -> int:
    """Return the bytes of the files of a recording."""
    return sum(one.stat().st_size for one in recording.iterdir())


def remove_recording(recording: Path) -> None:
    """Remove the files of a recording, and its folder if nothing else is in it.

    What makes it a recording goes last: a node killed meanwhile leaves one, to be removed later.
    """
    for one in sorted(recording.iterdir(), key=lambda one: one.name == _DESCRIPTION):
        if _is_written(one):
            one.unlink()
    recording.rmdir()


def remove_oldest(
    folder: Path, valve: str, most: int, most_bytes: float, new: Path | None = None
) -> None:
    """Remove the oldest recordings of a valve until few enough, and small enough, are left.

    Of recordings of one level in a row the first goes last: it shows how the trouble began, the
    others a level that flaps.

    Only folders by the name of such a recording count that hold the files of one and no others. The
    `new` one counts and stays. What a killed node has left of this valve goes after a day. Raises
    OSError if something cannot be removed.
    """
    pattern = re.compile(rf"alarm_{re.escape(valve)}_(\d{{8}}T\d{{6}}Z)_(WARN|ERROR)(?:_(\d+))?")
    found: dict[Path, tuple[str, int, str]] = {}
    for place in _folders(folder):
        if (name := pattern.fullmatch(place.name)) and _is_recording(place):
            found[place] = name[1], int(name[3] or 1), name[2]
        elif place.name.startswith(".saving_") and _is_left(place, pattern):
            shutil.rmtree(place)
    oldest = _useless_first(found)
    if new in oldest:
        oldest.remove(new)
        oldest.append(new)
    sizes = [size_of(place) for place in oldest]
    while oldest and oldest[0] != new and (len(oldest) > most or sum(sizes) > most_bytes):
        remove_recording(oldest.pop(0))
        sizes.pop(0)


def _useless_first(found: Mapping[Path, tuple[str, int, str]]) -> list[Path]:
    """Sort recordings by age, and put the first of each level in a row behind the others."""
    firsts: list[Path] = []
    others: list[Path] = []
    before = ""
    for place, (_, _, level) in sorted(found.items(), key=lambda item: item[1]):
        (others if level == before else firsts).append(place)
        before = level
    return others + firsts


def _folders(folder: Path) -> Iterator[Path]:
    if folder.is_dir():
        for place in sorted(folder.iterdir()):
            if place.is_dir() and not place.is_symlink():
                yield place


def _is_recording(place: Path) -> bool:
    """Return whether a folder holds a recording and nothing else, or nothing at all."""
    files = list(place.iterdir())
    is_bag = any(one.name == _DESCRIPTION for one in files)
    return all(map(_is_written, files)) and (is_bag or not files)


def _is_written(file: Path) -> bool:
    """Return whether the node writes a file of this name into its folder."""
    name, folder = file.name, re.sub(r"_\d+$", "", file.parent.name)  # without a second's number
    return name in (_DESCRIPTION, f"{folder}.mcap") or _BESIDE.fullmatch(name) is not None


def _is_left(workplace: Path, pattern: re.Pattern[str]) -> bool:
    """Return whether a killed node has left an unfinished bag by such a name there."""
    names = [one.name for one in workplace.iterdir()]
    is_old = time.time() - workplace.stat().st_mtime > _STALE
    return is_old and len(names) == 1 and pattern.fullmatch(names[0]) is not None
