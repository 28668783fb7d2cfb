# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Where nodes write: within their folder and its room; and what is removed of alarm recordings."""

import errno
import os
import re
from pathlib import Path

import pytest

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.identifier.recordings import remove_oldest
from valve_friction_ros.nodes.plumbing.output_folder import (
    OutputFolder,
    folder_of,
    free_path,
    require_room,
)

NAME = "fv_101_20260102T030405Z"


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The data folder."""
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    monkeypatch.setenv("HOME", str(tmp_path / "person"))
    return tmp_path / "ros" / "valve_friction_ros"


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("", "ros/valve_friction_ros/reports"),
        ("plant/pages", "ros/valve_friction_ros/plant/pages"),
        ("plant/../pages", "ros/valve_friction_ros/pages"),
        ("~/pages", "person/pages"),
    ],
)
@pytest.mark.usefixtures("home")
def test_the_folder_that_is_given_or_the_usual_one(tmp_path, given, found):
    assert folder_of(given, "reports") == tmp_path / found
    with OutputFolder(given, "reports", "a report").opened() as folder:
        assert folder == tmp_path / found
        assert folder.is_dir()


@pytest.mark.usefixtures("home")
def test_an_absolute_folder_is_where_it_says(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "link").symlink_to("disk")
    assert folder_of(str(tmp_path / "link" / "pages"), "reports") == tmp_path / "disk" / "pages"


@pytest.mark.parametrize("given", ["../../etc", "a/../../etc", "link", "link/pages"])
def test_a_relative_folder_does_not_lead_out_of_the_data_folder(tmp_path, home, given):
    home.mkdir(parents=True)
    (home / "link").symlink_to(tmp_path)
    with pytest.raises(
        ValueError, match=f"^the folder {given} leads out of {home}, the base of relati"
    ):
        OutputFolder(given, "alarms", "a bag")


@pytest.mark.usefixtures("home")
def test_a_link_that_comes_later_is_not_followed(tmp_path):
    kept = OutputFolder(str(tmp_path / "plant" / "pages"), "reports", "a report")
    (tmp_path / "elsewhere" / "pages").mkdir(parents=True)
    (tmp_path / "plant").symlink_to("elsewhere")
    with pytest.raises(RefusalError, match=r"plant/pages: it has become a link to"), kept.opened():
        pytest.fail("the link was followed")


def test_an_unknown_home_is_refused():
    with (
        pytest.raises(RefusalError, match=r"^cannot write a report into ~nobody-such/x: Could not"),
        OutputFolder("~nobody-such/x", "reports", "a report").opened(),
    ):
        pytest.fail("there is no such folder")


@pytest.mark.parametrize(
    ("number", "told"),
    [
        (errno.ENOSPC, "No space left on device: make room on its disk, or choose another folder"),
        (errno.EACCES, "Permission denied: make it writable for the user of this process, or "
         "choose another folder"),
        (errno.EIO, "Input/output error"),
    ],
)  # fmt: skip
def test_trouble_with_the_disk_is_refused(tmp_path, number, told):
    folder = OutputFolder(str(tmp_path), "saved", "a bag")
    with pytest.raises(RefusalError) as refused, folder.opened():
        raise OSError(number, os.strerror(number))
    assert str(refused.value) == f"cannot write a bag into {tmp_path}: {told}"


def test_a_bug_is_not_blamed_on_the_folder(tmp_path):
    with (
        pytest.raises(RuntimeError, match=r"^a bug$"),
        OutputFolder(str(tmp_path), "reports", "a report").opened(),
    ):
        raise RuntimeError("a bug")


def test_a_link_has_the_name_that_it_has_wherever_it_leads(tmp_path):
    """A dangling one would be written through."""
    assert free_path(tmp_path, NAME, ".html") == tmp_path / f"{NAME}.html"
    (tmp_path / f"{NAME}.html").symlink_to(tmp_path / "nothing")
    assert free_path(tmp_path, NAME, ".html") == tmp_path / f"{NAME}_2.html"


TAKEN = 4 * 4096


@pytest.fixture
def folder(tmp_path):
    """A page of two blocks of 4,096 bytes, and a bag of two files of one block each."""
    (tmp_path / f"{NAME}.html").write_bytes(b"x" * 4097)
    bag = tmp_path / f"{NAME}_2"
    bag.mkdir()
    for name in ("metadata.yaml", "bag.mcap"):
        (bag / name).write_bytes(b"x")
    for other in ("fv_1011", "afv_101", "fv_101_a"):  # of other valves
        (tmp_path / f"{other}_20260102T030405Z.html").write_bytes(b"x" * 100_000)
    (tmp_path / "fv_101_notes.html").write_bytes(b"x" * 100_000)
    (bag / "link").symlink_to(tmp_path / "fv_101_notes.html")
    return tmp_path


def test_a_file_needs_room_which_it_may_fill(folder):
    require_room(folder, "fv_101", TAKEN + 1)
    require_room(folder, "fv_101", TAKEN, is_there=True)
    told = f"no space left: fv_101 uses 0.0164 MB in {folder}, and save_megabytes is 0.016384: move"
    with pytest.raises(RefusalError, match=f"^{re.escape(told)}"):
        require_room(folder, "fv_101", TAKEN)
    with pytest.raises(RefusalError, match="with this one"):
        require_room(folder, "fv_101", TAKEN - 1, is_there=True)


NAMES = [
    f"alarm_fv_101_20260101T{hour:02d}0000Z_{level}"
    for hour, level in enumerate(("ERROR", "WARN", "ERROR", "WARN"))
]


@pytest.fixture
def alarms(tmp_path):
    """Four recordings with their pages: another level each time."""
    for name in NAMES:
        (tmp_path / name).mkdir()
        for file in ("metadata.yaml", "valve.yaml", "report.html", ".12_report.html"):
            (tmp_path / name / file).write_bytes(b"x" * 1000)
        (tmp_path / name / f"{name}.mcap").write_bytes(b"x" * 1000)
    return tmp_path


def left(alarms):
    return sorted(path.name for path in alarms.iterdir())


def is_no_yaml(path):
    return path.suffix != ".yaml"


@pytest.mark.parametrize("files", range(6))
def test_a_kill_amid_a_removal_leaves_what_is_removed_later(alarms, monkeypatch, files):
    """Killed after any number of removed files; the alarms lists what makes it a bag first."""
    removed, listed = [], Path.iterdir

    def unlink(path):
        if len(removed) == files:
            raise KeyboardInterrupt
        removed.append(path)
        path.rename(alarms.parent / f"{alarms.name}_{len(removed)}")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", unlink)
        patch.setattr(
            Path,
            "iterdir",
            lambda path: sorted(listed(path), key=lambda one: one.suffix != ".yaml"),
        )
        patch.setattr(Path, "rmdir", lambda _: 1 / 0)
        with pytest.raises((KeyboardInterrupt, ZeroDivisionError)):
            remove_oldest(alarms, "fv_101", 3, 1e9)
    assert len(removed) == files
    remove_oldest(alarms, "fv_101", 3, 1e9)
    assert left(alarms) == NAMES[1:]


@pytest.mark.parametrize("name", ["my_plant_copy.mcap", f"{NAMES[1]}_copy.mcap", "note.txt"])
def test_a_folder_with_a_strange_file_stays(alarms, name):
    (alarms / NAMES[0] / name).touch()
    remove_oldest(alarms, "fv_101", 1, 1e9)
    assert left(alarms) == [NAMES[0], NAMES[3]]
    assert (alarms / NAMES[0] / name).exists()


def test_of_two_of_a_second_the_later_is_a_recording_too(alarms):
    later = alarms / f"{NAMES[0]}_2"
    later.mkdir()
    for file in ("metadata.yaml", f"{NAMES[0]}.mcap"):
        (later / file).touch()
    remove_oldest(alarms, "fv_101", 4, 1e9)
    assert left(alarms) == NAMES


def test_the_first_of_a_level_that_flaps_stays(tmp_path):
    names = [f"alarm_v_2026010{day}T000000Z_{level}" for day, level in enumerate("WEEEW")]
    names = [name.replace("_W", "_WARN").replace("_E", "_ERROR") for name in names]
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "metadata.yaml").touch()
    for most, kept in ((4, (0, 1, 3, 4)), (3, (0, 1, 4)), (2, (1, 4)), (1, (4,))):
        remove_oldest(tmp_path, "v", most, 1e9)
        assert left(tmp_path) == [names[n] for n in kept]


def test_the_newest_stays_though_it_flaps(tmp_path):
    names = [f"alarm_v_2026010{day}T000000Z_ERROR" for day in range(3)]
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "metadata.yaml").touch()
    remove_oldest(tmp_path, "v", 2, 1e9, new=tmp_path / names[2])
    assert left(tmp_path) == [names[0], names[2]]
    remove_oldest(tmp_path, "v", 1, 1e9, new=tmp_path / names[2])
    assert left(tmp_path) == [names[2]]
