# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files that a node writes on request: folder, names and limit of disk space."""

import contextlib
import os
import re
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.nodes.plumbing.worker import done_in
from valve_friction_ros.records.files import data_folder, disk_trouble
from valve_friction_ros.streams import utc

_BLOCK = 4096
"""Disk space of the smallest file on most file systems, bytes."""


def folder_of(given: str, usual: str) -> Path:
    """Return the folder given by a parameter, by default the folder `usual` in the data folder.

    The path returned is absolute, with links resolved. A relative path starts in the data folder.

    Raises
    ------
    ValueError
        If a relative path leads out of the data folder, by ``..`` or by a link.
    RuntimeError
        If the home directory in the path is unknown.
    OSError
        If links form a loop.
    """
    home = data_folder().expanduser().resolve()
    if not given:
        return (home / usual).resolve()
    path = Path(given).expanduser()
    folder = (home / path).resolve()
    if not path.is_absolute() and not folder.is_relative_to(home):
        raise ValueError(
            f"the folder {given} leads out of {home}, the base of relative paths: give its full "
            "path"
        )
    return folder


class OutputFolder:
    """The folder for one kind of file, fixed when the node starts.

    Parameters
    ----------
    given : str
        Value of the parameter.
    usual : str
        Default name in the data folder.
    content : str
        Description of the files with its article, for messages of refusal.

    Raises
    ------
    ValueError
        If a relative folder leads out of the data folder.
    """

    def __init__(self, given: str, usual: str, content: str) -> None:
        self._content, self._problem = content, ""
        self._folder = Path(given or usual)
        try:
            self._folder = folder_of(given, usual)
        except RuntimeError as error:  # of pathlib, if a home directory is unknown
            self._problem = f"{given or '~/.ros'}: {error}"
        except OSError as error:
            self._problem = f"{given}: {error.strerror or error}"

    @contextlib.contextmanager
    def opened(self) -> Iterator[Path]:
        """Provide the folder, created if missing; in any thread.

        Raises RefusalError if the folder could not be resolved at the start, a link has since
        redirected it, or the block raises OSError.
        """
        if self._problem:
            raise RefusalError(f"cannot write {self._content} into {self._problem}")
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if (now := self._folder.resolve()) != self._folder:
                raise RefusalError(
                    f"cannot write {self._content} into {self._folder}: it has become a link to "
                    f"{now} since the start: remove the link, or restart the node"
                )
            yield self._folder
        except OSError as error:
            raise RefusalError(
                f"cannot write {self._content} into {self._folder}: {disk_trouble(error)}"
            ) from None

    async def kept(
        self, node: Node, stamp: int, worker: ThreadPoolExecutor, write: Callable[[Path, str], Path]
    ) -> Path:
        """Write a file in a thread of `worker`, if the valve has disk space left.

        `write` receives the folder and a file name for this time (ns), and returns the path. Raises
        RefusalError and removes the file if there is not enough space.
        """
        valve = valve_name(node)
        name = f"{valve}_{utc(stamp):%Y%m%dT%H%M%SZ}"
        room = 1e6 * node.get_parameter("save_megabytes").value

        def write_within_room() -> Path:
            with self.opened() as folder:
                require_room(folder, valve, room)
                path = write(folder, name)
                try:
                    require_room(folder, valve, room, is_there=True)
                except RefusalError:
                    if path.is_dir():
                        shutil.rmtree(path)
                    else:
                        path.unlink()
                    raise
                return path

        return await done_in(worker, write_within_room)


def valve_name(node: Node) -> str:
    """Return the name of the node's valve for file names; ROS allows no dots or signs in it."""
    return node.get_namespace().strip("/").replace("/", "_") or node.get_name()


def free_path(folder: Path, name: str, ending: str) -> Path:
    """Return the first path with this name, numbered if necessary, that does not exist.

    A link exists even if its target does not.
    """
    names = (
        f"{name}{ending}" if number == 1 else f"{name}_{number}{ending}" for number in count(1)
    )
    return next(path for path in map(folder.joinpath, names) if not os.path.lexists(path))


def _size_of(path: Path) -> int:
    """Return the disk space of a file or of all files in a folder, bytes; a link takes none."""
    if path.is_symlink():
        return 0
    if path.is_dir():
        return sum(map(_size_of, path.iterdir()))
    return -(-path.stat().st_size // _BLOCK) * _BLOCK


def require_room(folder: Path, valve: str, room: float, is_there: bool = False) -> None:
    """Require that the files of a valve in a folder take less than `room`, bytes.

    Files belong to the valve if they have its name and a time. If the last file has already been
    written (`is_there`), they may take exactly `room`.

    Raises RefusalError if they take more.
    """
    pattern = re.compile(rf"{re.escape(valve)}_\d{{8}}T\d{{6}}Z(_\d+)?(\.html)?")
    taken = sum(_size_of(one) for one in folder.iterdir() if pattern.fullmatch(one.name))
    if taken > room or (taken == room and not is_there):
        with_it = " with this one" if is_there else ""
        raise RefusalError(
            f"no space left: {valve} uses {taken / 1e6:.3g} MB in {folder}{with_it}, and "
            f"save_megabytes is {room / 1e6:g}: move files away, or restart the node with a "
            "larger limit"
        )
