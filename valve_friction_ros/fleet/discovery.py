"""Which files and folders below a folder are recordings."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from valve_friction_ros.records.stores import explained, state_of, walk

__all__ = ["Findings", "FoundRecording", "find_recordings", "is_valve_file"]

_METADATA = "metadata.yaml"
_BAG_KEY = b"rosbag2_bagfile_information"
_VALVE_ENDING = "valve.yaml"
_PACKED = (".gz", ".zstd")
_STORAGE = (".mcap", ".db3")
_TABLES = (".csv", ".tsv", ".xlsx", ".xlsm", ".parquet")
_ENDINGS = (*_TABLES, ".bag", *_STORAGE)
"""Endings of recordings; a bag of ROS 1 is one, so that its refusal says how to convert it."""
_HIDDEN = (".", "~$")
"""Beginnings of names not meant for people; ``~$a.xlsx`` is there while Excel has a.xlsx open."""


@dataclass(frozen=True)
class FoundRecording:
    """A recording, not yet read: a file or the folder of a bag.

    Its name is its path from the searched folder, with slashes.
    """

    path: Path
    name: str

    @property
    def stem(self) -> str:
        """Its name without folders and endings: ``NAME`` of ``NAME.valve.yaml``."""
        return self.path.name if self.path.is_dir() else _bare(self.path.name)

    def content(self) -> str:
        """Return a fingerprint of size and time of change of its file or files.

        Raises OSError if they cannot be looked at.
        """
        folder = self.path.is_dir()
        files = sorted(self.path.iterdir()) if folder else [self.path]
        digest = hashlib.blake2b(digest_size=8)
        for file in files:
            if not is_valve_file(file.name):
                name = file.name if folder else ""
                digest.update(f"{name}\0{state_of(file)}\n".encode())
        return digest.hexdigest()


@dataclass(frozen=True)
class Findings:
    """The recordings of a folder, and the names of what is none, each in the order of names."""

    recordings: tuple[FoundRecording, ...]
    skipped: tuple[str, ...]


def is_valve_file(name: str) -> bool:
    """Return whether a file describes a valve: ``valve.yaml`` or ``NAME.valve.yaml``."""
    return name == _VALVE_ENDING or name.endswith(f".{_VALVE_ENDING}")


def _unpacked_name(name: str) -> str:
    for ending in _PACKED:
        if name.lower().endswith(ending):
            return name[: -len(ending)]
    return name


def _bare(name: str) -> str:
    return Path(_unpacked_name(name)).stem


def _is_recording(name: str) -> bool:
    return Path(_unpacked_name(name)).suffix.lower() in _ENDINGS


def _is_storage(name: str) -> bool:
    return Path(_unpacked_name(name)).suffix.lower() in _STORAGE


def _is_bag_folder(folder: Path, files: list[str]) -> bool:
    """Return whether a folder is a bag: metadata beside storage files, or metadata of rosbag2."""
    if _METADATA not in files:
        return False
    if any(_is_storage(name) for name in files):
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
    """Find the recordings in a folder and in those below it, on this machine or in a store.

    A folder with a ``metadata.yaml`` of rosbag2 is one recording, whatever it holds. Elsewhere
    each table, gzipped or not, and each storage file of a bag is one, found by its ending. Hidden
    files and folders and links to folders are skipped; so is a name that cannot be written on a
    line. Files and folders of `left_out`, such as the output, are neither recordings nor skipped.

    Raises ValueError if the folder is none, or cannot be read.
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
            if name.startswith(_HIDDEN) or not _is_recording(name) or not path.is_file():
                skipped.append(path.relative_to(folder).as_posix())
            else:
                recordings.append(path)
    found = [FoundRecording(path, path.relative_to(folder).as_posix()) for path in recordings]
    strange = [one for one in found if not _can_be_written(one.name)]
    skipped += [one.name for one in strange]
    good = sorted((one for one in found if one not in strange), key=lambda one: one.name)
    return Findings(tuple(good), tuple(sorted(skipped)))
