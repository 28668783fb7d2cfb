# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings in a folder tree, and the baselines of their valves."""

import csv
import hashlib
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from valve_friction_ros.health import Baseline, Measured, SlidingFriction
from valve_friction_ros.health.valve_numbers import COMPARED, IDENTIFIED_ONLY, fit_numbers
from valve_friction_ros.identification import Verdict
from valve_friction_ros.identification.settings import column_suffix
from valve_friction_ros.outside_text import as_read
from valve_friction_ros.records.files import (
    cause_of,
    explained,
    state_of,
    table_stem,
    unpacked_name,
    walk,
)

_METADATA = "metadata.yaml"
_BAG_KEY = b"rosbag2_bagfile_information"
_VALVE_ENDING = "valve.yaml"
_STORAGE = (".mcap", ".db3")
_TABLES = (".csv", ".tsv", ".xlsx", ".xlsm", ".parquet", ".txt", ".lvm", ".dat", ".mat")
_PERHAPS = (".txt", ".dat")
"""Ambiguous endings: such a file is a table if some of its first lines hold two numbers."""
_TWO_NUMBERS = re.compile(rb"^[^\n]*\d[\t;,| ][^\n]*\d", re.MULTILINE)
_LOOKED_AT, _FEWEST_ROWS = 16_384, 3
"""Bytes of such a file that are examined, and least rows of a table."""
_ENDINGS = (*_TABLES, ".bag", *_STORAGE)
"""Endings of recordings. ROS 1 bags are included, so that the refusal says how to convert them."""
_HIDDEN = (".", "~$")
"""Prefixes of hidden files; ``~$a.xlsx`` exists while Excel has a.xlsx open."""


@dataclass(frozen=True)
class FoundRecording:
    """A recording, not yet read: a file or the folder of a bag.

    Its name is its path from the searched folder, with slashes. If each signal of a valve has its
    own file, `beside` holds the other files.
    """

    path: Path
    name: str
    beside: tuple[Path, ...] = ()

    @property
    def stem(self) -> str:
        """Its name without folders and endings: ``NAME`` of ``NAME.valve.yaml``."""
        return self.path.name if self.path.is_dir() else table_stem(self.path)

    def content(self) -> str:
        """Return a fingerprint of size and modification time of its files.

        Raises OSError if a file cannot be accessed.
        """
        folder = self.path.is_dir()
        files = sorted(self.path.iterdir()) if folder else [self.path, *self.beside]
        digest = hashlib.blake2b(digest_size=8)
        for file in files:
            if not is_valve_file(file.name):
                name = file.name if folder else ""
                digest.update(f"{name}\0{state_of(file)}\n".encode())
        return digest.hexdigest()


@dataclass(frozen=True)
class Findings:
    """The recordings in a folder and the names of other files, both sorted by name."""

    recordings: tuple[FoundRecording, ...]
    skipped: tuple[str, ...]


def is_valve_file(name: str) -> bool:
    """Return whether a file describes a valve: ``valve.yaml`` or ``NAME.valve.yaml``."""
    return name == _VALVE_ENDING or name.endswith(f".{_VALVE_ENDING}")


def _ending(name: str) -> str:
    return Path(unpacked_name(name)).suffix.lower()


def _may_be_table(path: Path) -> bool:
    """Return whether a file may be a table; a file with an ambiguous ending is examined."""
    if Path(path.name).suffix.lower() not in _PERHAPS:
        return True
    try:
        with path.open("rb") as stream:
            start = stream.read(_LOOKED_AT).replace(b"\0", b"")
    except OSError:
        return True  # reading it later gives the cause
    return len(_TWO_NUMBERS.findall(start)) >= _FEWEST_ROWS


def _is_bag_folder(folder: Path, files: list[str]) -> bool:
    """Return whether a folder is a bag: metadata beside storage files, or metadata of rosbag2."""
    if _METADATA not in files:
        return False
    if any(_ending(name) in _STORAGE for name in files):
        return True
    try:
        return _BAG_KEY in (folder / _METADATA).read_bytes()
    except OSError:
        return False


def _can_be_written(name: str) -> bool:
    """Return whether a name can be written on one line of UTF-8."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return name.isprintable()


def find_recordings(folder: Path, *left_out: Path) -> Findings:
    """Find the recordings in a folder and its subfolders, on this machine or in a store.

    A folder with a ``metadata.yaml`` of rosbag2 is one recording, whatever else it holds. In other
    folders, each table, gzipped or not, and each storage file of a bag is a recording, found by its
    ending. Hidden files and folders, links to folders, and names that cannot be written on one line
    are skipped. Files and folders in `left_out`, such as the output, are neither found nor skipped.

    Raises ValueError if the folder does not exist or cannot be read.
    """
    with explained(folder):
        return _findings(folder, {path.resolve() for path in left_out})


def _findings(folder: Path, own: set[Path]) -> Findings:
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder")
    recordings, skipped = [], []
    for here, folders, files in walk(folder):
        if _is_bag_folder(here, files):
            recordings.append(here)
            folders.clear()
            continue
        folders[:] = [name for name in folders if (here / name).resolve() not in own]
        closed = {name for name in folders if name.startswith(".") or (here / name).is_symlink()}
        skipped += [f"{(here / name).relative_to(folder).as_posix()}/" for name in closed]
        folders[:] = sorted(set(folders) - closed)
        for name in files:
            path = here / name
            if path.resolve() in own or is_valve_file(name):
                continue
            is_one = not name.startswith(_HIDDEN) and _ending(name) in _ENDINGS and path.is_file()
            if not is_one or not _may_be_table(path):
                skipped.append(path.relative_to(folder).as_posix())
            else:
                recordings.append(path)
    found = [FoundRecording(path, path.relative_to(folder).as_posix()) for path in recordings]
    strange = [one for one in found if not _can_be_written(one.name)]
    skipped += [one.name for one in strange]
    good = sorted((one for one in found if one not in strange), key=lambda one: one.name)
    return Findings(tuple(good), tuple(sorted(skipped)))


_COULOMB, _SLIDING, _SPEED = "coulomb_friction", "sliding_friction", "sliding_speed_m_per_s"


@dataclass(frozen=True)
class Baselines:
    """Baselines by recording and by the name of the valve in it.

    A baseline without a recording applies to its valve in every recording.
    """

    by_recording: Mapping[str, Mapping[str, Baseline]]

    def of(self, recording: str) -> Mapping[str, Baseline]:
        """Return the baselines of a recording, by the names of its valves."""
        everywhere = self.by_recording.get("", {})
        return {**everywhere, **self.by_recording.get(recording, {})}

    def count(self, recordings: Iterable[str]) -> int:
        """Count the recordings that have a baseline."""
        return sum(bool(self.of(recording)) for recording in recordings)


def _number(row: Mapping[str, str | None], column: str) -> float:
    """Return a number of a row; nan if the cell is empty or missing."""
    text = (row.get(column) or "").strip()
    try:
        return float(text) if text else math.nan
    except ValueError:
        raise ValueError(f"column {column!r}: {text!r} is not a number") from None


def _friction(row: Mapping[str, str | None], name: str) -> Measured | None:
    """Return a friction; None if it is not above zero or has no interval."""
    value, width = _number(row, f"{name}_n"), _number(row, f"{name}_half_width_n")
    if math.isnan(width):  # exact, unless it was identified by a method without intervals
        width = math.inf if row.get(f"{name}_verdict") == Verdict.WEAK.value else 0.0
    return Measured(value, width) if value > 0 and math.isfinite(width) else None


def _numbers(row: Mapping[str, str | None]) -> dict[str, Measured]:
    """Return the other numbers of the valve that have intervals."""
    known = {}
    for name in COMPARED:
        suffix = column_suffix(name)
        value = _number(row, f"{name}{suffix}")
        width = _number(row, f"{name}_half_width{suffix}")
        sure = row.get(f"{name}_verdict") == Verdict.IDENTIFIED.value
        if math.isfinite(value) and width > 0 and (sure or name not in IDENTIFIED_ONLY):
            known[name] = Measured(value, width)
    return fit_numbers(known)


def _baseline(row: Mapping[str, str | None]) -> Baseline | None:
    """Return the baseline of a row; None if no friction is known well enough."""
    numbers = _numbers(row)
    coulomb, slid, speed = _friction(row, _COULOMB), _friction(row, _SLIDING), _number(row, _SPEED)
    sliding = None
    if slid is not None and speed > 0:
        sliding = SlidingFriction(slid.value, slid.half_width, speed)
    return Baseline.serving(coulomb, sliding, numbers)


def read_baselines(path: Path) -> Baselines:
    """Read the friction of healthy valves from a CSV file, as `identify-folder` writes it.

    The columns ``recording``, ``valve``, and the frictions with their half widths are used; an
    empty half width means an exact value. Other parameters are used if they have half widths. A
    friction that is not known well enough for a baseline is left out, and so is a refused valve.

    Raises ValueError, one line with file and row, if the file cannot be read.
    """
    found: dict[str, dict[str, Baseline]] = {}
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream)
            columns = set(reader.fieldnames or ())
            frictions = {f"{name}_n" for name in (_COULOMB, _SLIDING)}
            if not {"recording", "valve"} & columns or not frictions & columns:
                raise ValueError(
                    f"{path}: give a CSV file of identify-folder, or one with the columns "
                    f"recording, valve and {_COULOMB}_n"
                )
            for number, row in enumerate(reader, start=2):
                recording, valve = (as_read(row.get(key) or "") for key in ("recording", "valve"))
                try:
                    baseline = _baseline(row)
                except ValueError as error:
                    raise ValueError(f"{path}: row {number}: {error}") from None
                if baseline is None:
                    continue
                if valve in found.setdefault(recording, {}):
                    raise ValueError(
                        f"{path}: row {number}: a second baseline of {recording} {valve}"
                    )
                found[recording][valve] = baseline
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read: {cause_of(error)}") from None
    if not found:
        raise ValueError(f"{path}: no friction in it is known well enough to be a baseline")
    return Baselines(MappingProxyType(found))
