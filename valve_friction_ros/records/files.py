# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files and folders: the data folder, atomic writes, and object stores.

A file in a store has an fsspec name, such as ``s3://bucket/folder``. fsspec takes keys and
addresses of the stores from its own environment variables and configuration files.
"""

import contextlib
import errno
import os
import re
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

from valve_friction_ros.identification.refusal import RefusalError


def data_folder() -> Path:
    """Return the folder of the package under ROS_HOME, by default under ~/.ros.

    If the home directory is unknown, the path begins with ``~``.
    """
    home = os.environ.get("ROS_HOME") or Path("~/.ros")
    folder = Path(home) / "valve_friction_ros"
    with contextlib.suppress(RuntimeError):
        return folder.expanduser()
    return folder


def history_file() -> Path:
    """Return the default file of the history."""
    return data_folder() / "history.sqlite"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file completely or not at all; a failure keeps the previous file.

    A link stays a link; devices and pipes are written directly. Raises OSError, which names `path`.
    """
    place = path.resolve()
    is_special = place.exists() and not place.is_file()
    draft = place if is_special else place.with_name(f".{os.getpid()}_{place.name}")
    try:
        draft.write_bytes(content)
        if not is_special:
            draft.replace(place)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        if not is_special:
            with contextlib.suppress(OSError):  # a read-only folder has no draft
                draft.unlink(missing_ok=True)


def unpacked_name(name: str) -> str:
    """Return the name of a file without the ending of its compression."""
    return re.sub(r"\.(gz|zstd)\Z", "", name, flags=re.IGNORECASE | re.ASCII)


def table_stem(path: Path) -> str:
    """Return the name of a file without folders and endings; it may be the tag of a valve."""
    return Path(unpacked_name(path.name)).stem


def cause_of(error: Exception) -> str:
    """Return the message of the system for a system error, else the message of the error."""
    return str((isinstance(error, OSError) and error.strerror) or error)


_WRITABLE = "make it writable for the user of this process, or choose another folder"
_REMEDIES_OF_DISK = {
    errno.ENOSPC: "make room on its disk, or choose another folder",
    errno.EDQUOT: "make room, or raise the quota of the user of this process",
    errno.EFBIG: "raise the limit of the size of a file (ulimit -f)",
    errno.EACCES: _WRITABLE,
    errno.EPERM: _WRITABLE,
    errno.EROFS: "choose another folder",
    errno.ENOTDIR: "choose another folder",
}


def disk_trouble(error: OSError) -> str:
    """Return why something was not written, with the remedy if one is known."""
    remedy = _REMEDIES_OF_DISK.get(error.errno or 0)
    return cause_of(error) + (f": {remedy}" if remedy else "")


_REMEDY = "S3 needs `pip install s3fs 'universal_pathlib>=0.3.10,<0.4'` (the extra `stores`)"
_LONGEST_CAUSE = 200
_MARKS = ("ETag", "etag", "md5Hash", "mtime", "LastModified", "last_modified", "created")
"""Metadata of stores that change with the content of a file; the first one present is used."""


def place(name: str) -> Path:
    """Return the path of a file or folder on this machine, or in a store if the name has ://.

    The latter is a ``UPath`` of universal_pathlib, which serves here like a `Path`.

    Raises ValueError if the store is unknown or its library is not installed.
    """
    if "://" not in name:
        return Path(name)
    try:
        from upath import UPath  # noqa: PLC0415 - an extra, and slow to import

        path = UPath(name)
        path.fs  # noqa: B018 - its library is imported when it is first asked for
    except ImportError as error:
        raise ValueError(
            f"{name}: a library of this store is missing ({error}): {_REMEDY}"
        ) from None
    except ValueError as error:
        raise ValueError(f"{name}: no such store: {error}") from None
    return cast(Path, path)


def _is_stored(path: object) -> bool:
    return not isinstance(path, Path)


@contextlib.contextmanager
def explained(path: object) -> Iterator[None]:
    """Convert exceptions of the library of a store to a ValueError of one line."""
    try:
        yield
    except (ValueError, RefusalError):
        raise
    except Exception as error:
        if not _is_stored(path):
            raise
        cause = " ".join(cause_of(error).split())[:_LONGEST_CAUSE] or type(error).__name__
        raise ValueError(f"{path}: cannot be read: {cause}") from None


def _below(folder: Any) -> Iterator[tuple[Path, list[str], list[str]]]:
    root = folder.path.rstrip("/")
    for where, folders, files in folder.fs.walk(folder.path, on_error="raise"):
        inner = where.rstrip("/")[len(root) :].strip("/")
        files[:] = [name for name in files if name]  # stores list a folder as a file without a name
        yield folder / inner if inner else folder, folders, files


def walk(folder: Path) -> Iterator[tuple[Path, list[str], list[str]]]:
    """Walk through a folder and its subfolders, as `os.walk` does; names may be removed to prune.

    Raises ValueError if a folder cannot be read.
    """
    if _is_stored(folder):
        yield from _below(folder)
        return

    def refuse(error: OSError) -> None:
        raise ValueError(f"{error.filename}: cannot be read: {error.strerror}")

    for where, folders, files in os.walk(folder, onerror=refuse):
        yield Path(where), folders, files


def state_of(file: Path) -> str:
    """Return the size of a file, and a mark that changes with its content.

    Raises OSError if the file is not accessible.
    """
    if not _is_stored(file):
        state = file.stat()
        return f"{state.st_size}\0{state.st_mtime_ns}"
    stored = cast(Any, file)
    told = stored.fs.info(stored.path)
    mark = next((told[name] for name in _MARKS if told.get(name)), "")
    return f"{told['size']}\0{mark}"


def _fetch(path: Any, copy: Path) -> None:
    """Copy a stored file, or the files of a stored folder without its subfolders."""
    if path.fs.isdir(path.path):
        copy.mkdir()
        listed = path.fs.ls(path.path, detail=True)
        names = [each["name"].rpartition("/")[2] for each in listed if each["type"] == "file"]
        pairs = [(f"{path.path}/{name}", copy / name) for name in names if name not in ("", "..")]
    else:
        pairs = [(path.path, copy)]
    path.fs.get([source for source, _ in pairs], [str(target) for _, target in pairs])


@contextlib.contextmanager
def on_disk(path: Path) -> Iterator[Path]:
    """Provide a file, or the files of a folder, on the local disk, as a copy if necessary.

    The copy has the same name; errors raised in the block name the original. Raises ValueError if
    it cannot be fetched.
    """
    if not _is_stored(path):
        yield path
        return
    with TemporaryDirectory(prefix="valve_friction_") as folder:
        copy = Path(folder, path.name)
        with explained(path):
            _fetch(path, copy)
        try:
            yield copy
        except (RefusalError, ValueError) as error:
            kind = RefusalError if isinstance(error, RefusalError) else ValueError
            raise kind(str(error).replace(str(copy), str(path))) from None
