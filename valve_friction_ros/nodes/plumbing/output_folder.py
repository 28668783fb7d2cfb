# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files that a node writes on request: their folder, their names, and the room they may take."""

import contextlib
import os
import re
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.worker import done_in
from valve_friction_ros.records.files import data_folder
from valve_friction_ros.streams import utc

_BLOCK = 4096
"""Bytes that the smallest file takes on most disks."""


def folder_of(given: str, usual: str) -> Path:
    """Return the folder that a parameter gives, or else the `usual` one in the data folder.

    It is absolute, and its links are followed. A relative one lies in the data folder.

    Raises
    ------
    ValueError
        If a relative one leads out of the data folder, by ``..`` or by a link.
    RuntimeError
        If the home directory in the path is unknown.
    OSError
        If its links run in a circle.
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
    """The folder for one kind of files, fixed when the node starts.

    Parameters
    ----------
    given : str
        What the parameter says.
    usual : str
        Name in the data folder, where nothing is given.
    content : str
        What is written there, with its article; refusals name it.

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
        except RuntimeError as error:  # pathlib's, where a home directory is unknown
            self._problem = f"{given or '~/.ros'}: {error}"
        except OSError as error:
            self._problem = f"{given}: {error.strerror or error}"

    @contextlib.contextmanager
    def opened(self) -> Iterator[Path]:
        """Provide the folder, which is made if it is not there; in any thread.

        Raises RefusalError if it was not found at the start, leads elsewhere since by a link, or
        the block raises OSError.
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
            cause = error.strerror or error
            raise RefusalError(
                f"cannot write {self._content} into {self._folder}: {cause}"
            ) from None

    async def kept(
        self,
        node: Node,
        stamp: int,
        worker: ThreadPoolExecutor,
        write: Callable[[Path, str], Path],
    ) -> Path:
        """Have something written in a thread of `worker`, if the node's valve has room for it.

        `write` is given the folder and the name of a file at this time (ns), and returns the path.
        Raises RefusalError, and removes what was written, if there is no room.
        """
        valve, name = valve_name(node), file_name(node, stamp)
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
    """Name the node's valve as a part of file names; ROS allows no dots and other signs in it."""
    return node.get_namespace().strip("/").replace("/", "_") or node.get_name()


def file_name(node: Node, stamp: int) -> str:
    """Name a file, without its ending, after the node's valve and a time (ns)."""
    return f"{valve_name(node)}_{utc(stamp):%Y%m%dT%H%M%SZ}"


def free_path(folder: Path, name: str, ending: str) -> Path:
    """Return the first path of this name, or with a number after it, that is not there.

    A link is there, wherever it leads.
    """
    names = (
        f"{name}{ending}" if number == 1 else f"{name}_{number}{ending}" for number in count(1)
    )
    return next(path for path in map(folder.joinpath, names) if not os.path.lexists(path))


def _size_of(path: Path) -> int:
    """Return the bytes that a file, or the files of a folder, take on a disk; a link takes none."""
    if path.is_symlink():
        return 0
    if path.is_dir():
        return sum(map(_size_of, path.iterdir()))
    return -(-path.stat().st_size // _BLOCK) * _BLOCK


def require_room(folder: Path, valve: str, room: float, is_there: bool = False) -> None:
    """Refuse to write more where the files of a valve in a folder take their room, bytes.

    Only what is named as `file_name` names it is of the valve. What has just been written
    (`is_there`) may fill the room.

    Raises RefusalError if there is no room.
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
