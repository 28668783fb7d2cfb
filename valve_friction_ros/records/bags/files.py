"""Storage files of a bag: their names, their formats, and how each is opened."""

import contextlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml
from backports import zstd

from valve_friction_ros.records.bags.kind import MCAP, ROS_1, SQLITE, ZSTD, first_bytes
from valve_friction_ros.records.bags.rosbags_internals import McapFile
from valve_friction_ros.records.bags.salvage import SalvagedMcap
from valve_friction_ros.records.bags.sqlite_file import SqliteFile
from valve_friction_ros.records.bags.storage import Storage

__all__ = ["opened", "storage_files"]

_STORAGE = re.compile(r"\.(mcap|db3)(\.zstd)?$")


def _in_order(path: Path) -> list[str | int]:
    """Key that sorts bag_2 before bag_10."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", path.name)]


def _named_files(folder: Path) -> list[str] | None:
    """Names of the files in a bag's metadata; None where there is none that can be read."""
    try:
        content = yaml.safe_load((folder / "metadata.yaml").read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        return [Path(name).name for name in names] or None
    except (OSError, ValueError, yaml.YAMLError, LookupError, TypeError):
        return None


def storage_files(path: Path) -> tuple[list[Path], list[str]]:
    """Return the storage files of a bag in the order of time, and notes on what is missing.

    Raises ValueError if there is none.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if not path.is_dir():
        return [path], []
    names = _named_files(path)
    there = sorted((file for file in path.iterdir() if _STORAGE.search(file.name)), key=_in_order)
    if names is None:
        files = there
        notes = ["without a metadata.yaml that can be read: took all storage files in the folder"]
    else:
        files = [path / name for name in names if (path / name).exists()]
        absent = [name for name in names if not (path / name).exists()]
        surplus = [file.name for file in there if file.name not in names]
        notes = [f"{', '.join(absent)} of metadata.yaml is not there"] if absent else []
        if surplus:
            notes.append(f"{', '.join(surplus)} is not in metadata.yaml, and was left out")
    if not files:
        raise ValueError(
            f"{path}: no bag: the folder holds no .mcap or .db3 file: name the folder that the "
            "recorder made"
        )
    return files, notes


@contextlib.contextmanager
def _unpacked(path: Path) -> Iterator[Path]:
    """Unpack a file that was compressed as a whole; of a cut file, the part that is there."""
    if not first_bytes(path).startswith(ZSTD):
        yield path
        return
    with TemporaryDirectory() as folder:
        unpacked = Path(folder, path.stem)
        with (
            contextlib.suppress(EOFError, zstd.ZstdError),
            zstd.open(path) as packed,
            unpacked.open("wb") as whole,
        ):
            shutil.copyfileobj(packed, whole)
        yield unpacked


def _is_mcap(path: Path, start: bytes) -> bool:
    """Return True for MCAP, False for SQLite3, by the first bytes; refuse anything else."""
    if start.startswith((MCAP, SQLITE)):
        return start.startswith(MCAP)
    if not start and path.stat().st_size:
        raise ValueError(f"{path}: nothing of it can be unpacked: copy or record it anew")
    if not start:
        raise ValueError(f"{path}: the file is empty: nothing was recorded, or copied")
    if start.startswith(ROS_1):
        raise ValueError(f"{path}: a bag of ROS 1: convert it by rosbags-convert")
    raise ValueError(f"{path}: neither MCAP nor SQLite3, whatever its name says: record it anew")


@contextlib.contextmanager
def opened(path: Path, salvage: bool) -> Iterator[Storage]:
    """Open a storage file, compressed or not; its first bytes give its format.

    With `salvage` it is read without its index as far as it goes. Raises ValueError if it is no
    storage file of ROS 2, and DamagedFileError if it cannot be read without salvage, now or while
    its messages are gone through.
    """
    with _unpacked(path) as file:
        is_mcap = _is_mcap(path, first_bytes(file))
        if is_mcap and salvage:
            yield SalvagedMcap(file)
            return
        storage = McapFile(path, file) if is_mcap else SqliteFile(path, file, salvage)
        with contextlib.closing(storage):
            yield storage
