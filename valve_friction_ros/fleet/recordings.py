# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings in a folder tree, the table of the valves of their plant, and their baselines."""

import csv
import hashlib
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_numbers import COMPARED, IDENTIFIED_ONLY, fit_numbers
from valve_friction_ros.history.place import BESIDE_ENDINGS
from valve_friction_ros.identification.settings import column_suffix
from valve_friction_ros.identification.trust.verdict import Verdict
from valve_friction_ros.outside_text import as_read, nearest, resembling
from valve_friction_ros.records.bags.topics import is_bag
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.files import (
    cause_of,
    explained,
    on_disk,
    state_of,
    table_stem,
    unpacked_name,
    walk,
)
from valve_friction_ros.records.header_words import named
from valve_friction_ros.records.table import layout_of
from valve_friction_ros.records.table_rows import encoding_of
from valve_friction_ros.records.valve_description import QUESTIONS, valve_description
from valve_friction_ros.records.valve_file import ValveFile, valve_file_of

_METADATA = "metadata.yaml"
_BAG_KEY = b"rosbag2_bagfile_information"
_VALVE_ENDING = "valve.yaml"
_STORAGE = (".mcap", ".db3")
_TABLES = (".csv", ".tsv", ".xlsx", ".xlsm", ".parquet", ".txt", ".lvm", ".dat", ".mat")
_PERHAPS = (".txt", ".dat")
"""Ambiguous endings: such a file is a table if some of its first lines hold two numbers."""
_TWO_NUMBERS = re.compile(rb"^[^\n]*\d[Z\"]?[\t;,| ][^\n]*\d", re.MULTILINE)
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


def find_recordings(folder: Path, *left_out: Path) -> Findings:
    """Find the recordings in a folder and its subfolders, on this machine or in a store.

    A folder with a ``metadata.yaml`` of rosbag2 is one recording, whatever else it holds. In other
    folders, each table, gzipped or not, and each storage file of a bag is a recording, found by its
    ending. Hidden files and folders, links to folders, and names that cannot be written on one line
    are skipped. Files and folders in `left_out`, such as the output, are neither found nor skipped.

    Raises ValueError if the folder does not exist or cannot be read.
    """
    with explained(folder):
        endings = ("", *BESIDE_ENDINGS)
        own = {Path(f"{path.resolve()}{end}") for path in left_out for end in endings}
        return _findings(folder, own)


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
    strange = [one for one in found if not one.name.isprintable()]  # on one line of UTF-8
    skipped += [one.name for one in strange]
    good = sorted((one for one in found if one not in strange), key=lambda one: one.name)
    return Findings(tuple(good), tuple(sorted(skipped)))


# The valves of a plant

_NUMBERS = {name: name for name in ("area", "travel", "opposing_area", "mass")}
_NUMBERS |= {"spring": "spring_range", "range": "sensor_range"}
"""Columns of numbers with units, and their names in `QUESTIONS`."""
_NO_VALUE = ("none", "-", "–", "n/a")
"""Cells of such a column that are as good as empty, such as the spring of a piston."""
_WORDS = ("tag", "air_to", "sensor")
_READ = {question.name: question.read for question in QUESTIONS}
_HEADER = re.compile(r"\s*([\w ]+?)\s*(?:[\[(](.+)[\])])?\s*")
_MOST_FAULTS = 6
_MOST_SIGNALS = 3
"""Most single-signal files in one record of a valve: pressure, position, set point."""


_KNOWN = [*_WORDS, *_NUMBERS, *(each.name for each in fields(Columns))]


def _value(read: Callable[[str], Any], cell: str, unit: str) -> Any:
    """Read a number in the unit of its column, unless the cell has a unit of its own."""
    try:
        return read(f"{cell} {unit}".strip())
    except ValueError:
        with suppress(ValueError):
            return read(cell)
        raise


def _row(cells: Mapping[str, tuple[str, str]]) -> str:
    """Return the valve file of a row; each cell comes with the unit of its column."""
    values: dict[str, Any] = {}
    columns: dict[str, Any] = {}
    for name, (cell, unit) in cells.items():
        number = _NUMBERS.get(name)
        try:
            if number is not None and cell.casefold() not in _NO_VALUE:
                values[number] = _value(_READ[number], cell, unit)
            elif number is None and name not in _WORDS:
                columns[name] = yaml.safe_load(cell) if cell.lower() in ("true", "false") else cell
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    tag = cells["tag"][0]
    if missing := [name for name in ("area", "travel") if name not in values]:
        raise ValueError(f"{tag}: {' and '.join(missing)} missing")
    sensor, air_to = (cells.get(name, ("", ""))[0].casefold() for name in ("sensor", "air_to"))
    words = {
        "tag": tag,
        "sensor": "absolute" if sensor.startswith("abs") else "gauge",
        "air_to": "close" if air_to == "close" else "open",
        "acting": "double" if "opposing_area" in values else "single",
        "position": "plug",
    }
    return valve_description({**values, **words}, columns)


def _table(path: Path) -> tuple[list[tuple[str, str]], list[list[str]]]:
    """Return columns with units, and rows of a table; refuse misspelled columns."""
    try:
        content = path.read_bytes()
        text = content.decode(encoding_of(content))
        dialect = csv.Sniffer().sniff(text[:10_000], ",;\t")
        header, *rows = [row for row in csv.reader(text.splitlines(), dialect) if any(row)]
    except (OSError, UnicodeError, csv.Error, ValueError) as error:
        raise ValueError(f"{path}: cannot be read as a table: {cause_of(error)}") from None
    heads = []
    for cell in header:
        found = _HEADER.fullmatch(cell)
        name = found[1].casefold().replace(" ", "_") if found else cell
        if name not in _KNOWN and (close := resembling(name, _KNOWN)):
            raise ValueError(f"{path}: unknown column {cell[:60]!r}: {nearest(name, close)}")
        heads.append((name, (found[2] or "") if found else ""))
    if "tag" not in dict(heads):
        raise ValueError(f"{path}: there is no column tag: give tag, area, travel, spring, range")
    return heads, rows


def read_plant(path: Path) -> dict[str, ValveFile]:
    """Read the valves of a plant from a CSV file: tag, area, travel, spring, range.

    A number has its unit in its cell or in its header, as in ``travel [mm]``. Further columns are
    ``air_to``, ``sensor`` (gauge or absolute), ``opposing_area``, ``mass``, and the keys of the
    section ``columns:`` of a valve file, such as ``pressure_unit``. Other columns of a valve list
    are ignored.

    Returns
    -------
    dict of str to ValveFile
        The valves by tag.

    Raises
    ------
    ValueError
        If the table cannot be read; the message names the file and all faulty rows.
    """
    heads, rows = _table(path)
    valves: dict[str, ValveFile] = {}
    faults = []
    for number, row in enumerate(rows, start=2):
        cells = {
            name: (cell.strip(), unit)
            for (name, unit), cell in zip(heads, row, strict=False)
            if cell.strip() and name in _KNOWN
        }
        try:
            if "tag" not in cells:
                raise ValueError("it has no tag")
            text, tag = _row(cells), cells["tag"][0]
            if tag in valves:
                raise ValueError(f"a second {tag}")
            valves[tag] = valve_file_of(yaml.safe_load(text), path)
        except ValueError as error:
            faults.append(f"row {number}: {str(error).removeprefix(f'{path}: ')}")
    if faults:
        more = f"; and {len(faults) - _MOST_FAULTS} more" if len(faults) > _MOST_FAULTS else ""
        raise ValueError(f"{path}: {'; '.join(faults[:_MOST_FAULTS])}{more}")
    if not valves:
        raise ValueError(f"{path}: there are no valves in it")
    return valves


def _pattern(tag: str) -> re.Pattern[str]:
    parts = re.findall(r"[^\W\d_]+|\d+", tag)
    return re.compile(
        r"(?<![^\W_])" + r"[\W_]*".join(map(re.escape, parts)) + r"(?!\d)", re.IGNORECASE
    )


def tags_in(texts: Iterable[str], tags: Iterable[str]) -> list[str]:
    """Return the tags found in texts, with any separators between letters and digits.

    A tag that is only the beginning of another tag in the text, as FV-10 in FV-10A, is not found.
    """
    whole = "\n".join(texts)
    found: list[str] = []
    for tag in sorted(tags, key=len, reverse=True):
        pattern = _pattern(tag)
        if pattern.search(whole):
            found.append(tag)
            whole = pattern.sub("\n", whole)
    return found


def _tags_named(texts: Iterable[str], plant: Mapping[str, ValveFile]) -> list[str]:
    """Return the tags of the valves named in texts, by their own tags or those of their signals."""
    texts = list(texts)
    if found := tags_in(texts, plant):
        return found
    names: dict[str, list[str]] = {}
    for tag, valve in plant.items():
        form = valve.columns
        for name in (form.pressure_column, form.position_column, form.force_column):
            names.setdefault(name, []).append(tag)
    own = {name: tags[0] for name, tags in names.items() if name and len(tags) == 1}
    return [*dict.fromkeys(own[name] for name in tags_in(texts, own))]


def _tag_of(name: str, plant: Mapping[str, ValveFile]) -> str:
    """Return the tag named in the path of a recording; empty if it names none or several."""
    named = (_tags_named([text], plant) for text in reversed(Path(name).parts))
    return next((found[0] for found in named if len(found) == 1), "")


def _is_part(found: FoundRecording, valve: ValveFile) -> bool:
    """Return whether a table holds only one signal, too few to identify a valve."""
    try:
        with on_disk(found.path) as path:
            if is_bag(path) or layout_of(path, valve.columns).valves:
                return False
            layout = layout_of(path, valve.columns, is_part=True)
    except (ValueError, OSError):
        return False  # reading it later gives the cause
    signals = {one.name for group in layout.valves.values() for one in group}
    return len(signals | {*layout.unclear}) == 1


def with_parts_joined(
    recordings: Sequence[FoundRecording], plant: Mapping[str, ValveFile]
) -> Iterator[FoundRecording]:
    """Yield the recordings, with the single-signal files of a valve in a folder joined to one.

    If a folder holds several records of a valve, files belong together if their names differ only
    in the words for the signals, as in ``FV101.PT 2026Q1.csv`` and ``FV101.ZT 2026Q1.csv``.
    """
    alike: dict[tuple[Path, str], list[FoundRecording]] = {}
    for found in recordings:
        if tag := _tag_of(found.name, plant):
            alike.setdefault((found.path.parent, tag), []).append(found)
    joined: dict[FoundRecording, FoundRecording | None] = {}
    for (_, tag), files in alike.items():
        parts = [one for one in files if len(files) > 1 and _is_part(one, plant[tag])]
        groups: dict[str, list[FoundRecording]] = {}
        for one in parts:
            label = named([one.stem]).label if len(parts) > _MOST_SIGNALS else ""
            groups.setdefault(label, []).append(one)
        for first, *others in groups.values():
            joined |= dict.fromkeys(others)
            name = " + ".join([first.name, *(one.path.name for one in others)])
            joined[first] = replace(first, name=name, beside=tuple(one.path for one in others))
    whole = (joined.get(found, found) for found in recordings)
    yield from (found for found in whole if found is not None)


def valves_of(
    path: Path, name: str, plant: Mapping[str, ValveFile], is_table: bool
) -> Sequence[tuple[str, str, ValveFile]]:
    """Find the valves of a recording by its name, else by its content.

    Returns for each valve its label in the file (empty for a single valve), its tag, and the valve.

    Raises ValueError if no tag is found, or if several are found and the file does not assign the
    signals to them.
    """
    if tag := _tag_of(name, plant):
        return [("", tag, plant[tag])]
    if is_table:
        layout = layout_of(path, Columns())
        labels = [label for label in layout.valves if label]
        by_label = [(label, _tags_named([label], plant)) for label in labels]
        if by_label and all(len(tags) == 1 for _, tags in by_label):
            return [(label, tag, plant[tag]) for label, (tag,) in by_label]
        found = _tags_named([*layout.headers, *layout.texts], plant)
        if len(found) == 1:
            return [("", found[0], plant[found[0]])]
        if found:
            raise ValueError(
                f"it names several valves ({', '.join(found)}): put a single tag into its name"
            )
    raise ValueError("no tag of the plant is in its name or above its values: rename it")


# Baselines

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
        raise ValueError(f"{path}: no friction in it is known well enough for a baseline")
    return Baselines(MappingProxyType(found))
