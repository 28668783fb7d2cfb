# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files that are written whole or not at all."""

import errno
import os
import threading
from pathlib import Path

import pytest

from valve_friction_ros.records.files import write_whole


@pytest.fixture
def full_disk(monkeypatch):
    """Half of each file is written, then the disk is full."""
    written = Path.write_bytes

    def write_half(path, content):
        written(path, content[: len(content) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", write_half)


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_a_new_file_and_one_in_its_place(tmp_path):
    path = tmp_path / "page.html"
    for content in (b"first", b"second"):
        write_whole(path, content)
        assert path.read_bytes() == content
    assert names(tmp_path) == {"page.html"}


@pytest.mark.usefixtures("full_disk")
def test_no_part_of_it_stays(tmp_path):
    path = tmp_path / "picture.png"
    with pytest.raises(OSError, match="No space left") as raised:
        write_whole(path, b"content")
    assert raised.value.filename == str(path)
    assert names(tmp_path) == set()


@pytest.mark.usefixtures("full_disk")
def test_what_was_there_stays(tmp_path):
    path = tmp_path / "picture.png"
    path.touch()
    with path.open("wb") as stream:
        stream.write(b"before")
    with pytest.raises(OSError, match="No space left"):
        write_whole(path, b"content")
    assert path.read_bytes() == b"before"
    assert names(tmp_path) == {"picture.png"}


def test_no_folder(tmp_path):
    path = tmp_path / "none" / "picture.png"
    with pytest.raises(FileNotFoundError) as raised:
        write_whole(path, b"content")
    assert raised.value.filename == str(path)


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "folder").mkdir()
    place, link = tmp_path / "folder" / "place.png", tmp_path / "link.png"
    link.symlink_to(place)
    write_whole(link, b"content")
    assert link.is_symlink()
    assert place.read_bytes() == b"content"


def test_a_pipe_is_written_to(tmp_path):
    path = tmp_path / "pipe.png"
    os.mkfifo(path)
    writer = threading.Thread(target=write_whole, args=(path, b"content"))
    writer.start()
    assert path.read_bytes() == b"content"
    writer.join()
    assert path.is_fifo()


def test_a_device_stays():
    with pytest.raises(OSError, match="No space left"):
        write_whole(Path("/dev/full"), b"content")
    assert Path("/dev/full").is_char_device()


def test_a_read_only_folder_names_the_file(tmp_path, monkeypatch):
    """Neither the draft nor its removal is what the user asked for."""

    def refuse(self, *_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(self))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OSError, match="Read-only") as error:
        write_whole(tmp_path / "x.png", b"")
    assert error.value.filename == str(tmp_path / "x.png")
