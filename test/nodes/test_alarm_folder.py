# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is removed from a folder of alarm recordings, and what stays."""

from pathlib import Path

import pytest

from valve_friction_ros.nodes.identifier.alarm_recorder import remove_oldest

NAMES = [
    f"alarm_fv_101_20260101T{hour:02d}0000Z_{level}"
    for hour, level in enumerate(("ERROR", "WARN", "ERROR", "WARN"))
]


@pytest.fixture
def folder(tmp_path):
    """Four recordings with their pages: another level each time."""
    for name in NAMES:
        (tmp_path / name).mkdir()
        for file in ("metadata.yaml", "valve.yaml", "report.html", ".12_report.html"):
            (tmp_path / name / file).write_bytes(b"x" * 1000)
        (tmp_path / name / f"{name}.mcap").write_bytes(b"x" * 1000)
    return tmp_path


def left(folder):
    return sorted(path.name for path in folder.iterdir())


def is_no_yaml(path):
    return path.suffix != ".yaml"


@pytest.mark.parametrize("files", range(6))
def test_a_kill_amid_a_removal_leaves_what_is_removed_later(folder, monkeypatch, files):
    """Killed after any number of removed files; the folder lists what makes it a bag first."""
    removed, listed = [], Path.iterdir

    def unlink(path):
        if len(removed) == files:
            raise KeyboardInterrupt
        removed.append(path)
        path.rename(folder.parent / f"{folder.name}_{len(removed)}")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", unlink)
        patch.setattr(
            Path,
            "iterdir",
            lambda path: sorted(listed(path), key=lambda one: one.suffix != ".yaml"),
        )
        patch.setattr(Path, "rmdir", lambda _: 1 / 0)
        with pytest.raises((KeyboardInterrupt, ZeroDivisionError)):
            remove_oldest(folder, "fv_101", 3, 1e9)
    assert len(removed) == files
    remove_oldest(folder, "fv_101", 3, 1e9)
    assert left(folder) == NAMES[1:]


@pytest.mark.parametrize("name", ["my_plant_copy.mcap", f"{NAMES[1]}_copy.mcap", "note.txt"])
def test_a_folder_with_a_strange_file_stays(folder, name):
    (folder / NAMES[0] / name).touch()
    remove_oldest(folder, "fv_101", 1, 1e9)
    assert left(folder) == [NAMES[0], NAMES[3]]
    assert (folder / NAMES[0] / name).exists()


def test_of_two_of_a_second_the_later_is_a_recording_too(folder):
    later = folder / f"{NAMES[0]}_2"
    later.mkdir()
    for file in ("metadata.yaml", f"{NAMES[0]}.mcap"):
        (later / file).touch()
    remove_oldest(folder, "fv_101", 4, 1e9)
    assert left(folder) == NAMES


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
