# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The YAML file of a valve, or of its nodes: what it may hold; and files that are written whole."""

import dataclasses
import errno
import math
import os
import threading
from pathlib import Path

import pytest

from valve_friction_ros.identification import FIXABLE
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Valve
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.records.valve_file import read_valve_file


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "valve.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


class TestGoodFiles:
    def test_the_bench_valve_of_the_package(self, bench_yaml):
        found = read_valve_file(bench_yaml)
        assert found.valve == BENCH_VALVE
        assert dict(found.known) == {"mass": 1.6}

    def test_all_keys(self, write):
        known = {name: getattr(LOW_FRICTION, name) for name in FIXABLE}
        everything = dataclasses.asdict(BENCH_VALVE) | known
        lines = [f"{name}: {value!r}\n" for name, value in everything.items()]
        found = read_valve_file(write("".join(lines)))
        assert found.valve == BENCH_VALVE
        assert dict(found.known) == known

    def test_whole_numbers_and_powers_of_ten(self, write):
        """YAML 1.1 takes 2e5 for a text; people do not."""
        found = read_valve_file(write("diaphragm_area: 1\npressure_maximum: 2e5\ntravel: 3e-2\n"))
        assert found.valve == Valve(1.0, travel=0.03, pressure_maximum=2e5)
        assert isinstance(found.valve.diaphragm_area, float)

    @pytest.mark.parametrize(
        ("line", "valve", "known"),
        [
            ("", Valve(1.0), {}),
            ("travel: .inf", Valve(1.0, travel=math.inf), {}),
            ("static_friction: 5.0", Valve(1.0), {"static_friction": 5.0}),
        ],
    )
    def test_only_the_area_is_needed(self, write, line, valve, known):
        found = read_valve_file(write(f"diaphragm_area: 1.0\n{line}\n"))
        assert (found.valve, dict(found.known)) == (valve, known)

    def test_what_is_stated_is_neither_fixed_nor_assumed(self, write):
        text = "diaphragm_area: 1.0\nspring_constant: 2e5\nspring_preload: -9.0\nmass: 2.0\n"
        stated = {"spring_constant": 2e5, "spring_preload": -9.0, "mass": 2.0}
        assert read_valve_file(write(text + "coulomb_friction: 5.0\n")).stated == stated
        assert read_valve_file(write(text + "assumed_mass: 1.0\n")).stated == stated
        text = "diaphragm_area: 1.0\nfixed.spring_constant: 2e5\nassumed_mass: 2.0\n"
        assert read_valve_file(write(text)).stated == {}

    def test_the_known_values_are_read_only(self, bench_yaml):
        with pytest.raises(TypeError):
            read_valve_file(bench_yaml).known["mass"] = 2.0


BROKEN = [
    ("travel: 0.03", "diaphragm_area is missing"),
    ("", "expected lines such as 'diaphragm_area: 0.0445'"),
    ("- 0.0445", "expected lines such as 'diaphragm_area: 0.0445'"),
    ("diaphragm_area 0.0445", "expected lines such as 'diaphragm_area: 0.0445'"),
    ("diaphragm_area: [0.0445", "not YAML: while parsing a flow sequence"),
    ("diaphragm_area: 1.0\n\ttravel: 1.0", "not YAML: while scanning"),
    ("diaphragm_area: 1.0\ntravel: 0.02\ntravel: 0.03", "not YAML: travel is given twice in "),
    ("diaphragm_area: 1.0\n? [travel]\n: 1.0", "not YAML: while constructing a mapping"),
    ("diaphragm_area: 1.0\nmas: 1.0", "unknown key 'mas'; did you mean 'mass'?"),
    (
        "/**:\n  ros__parameters: {diaphragm_area: 0.04, warn_ration: 1.2}",
        "unknown key 'warn_ration'; did you mean 'warn_ratio'?",
    ),
    ("diaphragm_area: 1.0\n17: 1.0", "unknown key 17; known are diaphragm_area, pressure_ref"),
    ("diaphragm_area: 0.0", "diaphragm_area must be above zero, got 0"),
    ("diaphragm_area: .nan", "diaphragm_area must be finite, got nan"),
    ("diaphragm_area: wide", "diaphragm_area must be a number, got 'wide'"),
    ("diaphragm_area:", "diaphragm_area must be a number, got None"),
    ("diaphragm_area: true", "diaphragm_area must be a number, got True"),
    ("diaphragm_area: [1.0]", "diaphragm_area must be a number, got [1.0]"),
    ("diaphragm_area: 1.0\ntravel: -0.1", "travel must be above zero, got -0.1"),
    ("diaphragm_area: 1.0\npressure_reference: .inf", "pressure_reference must be finite, got"),
    ("diaphragm_area: 1.0\npressure_minimum: low", "pressure_minimum must be a number, got 'low'"),
    ("diaphragm_area: 1.0\npressure_maximum: yes", "pressure_maximum must be a number, got True"),
    (
        "diaphragm_area: 1.0\npressure_minimum: 2.0\npressure_maximum: 1.0",
        "pressure_minimum (2) must be below pressure_maximum (1)",
    ),
    ("diaphragm_area: 1.0\nmass: 0.0", "mass must be above zero, got 0"),
    ("diaphragm_area: 1.0\nmass: -1.0", "mass must be above zero, got -1"),
    ("diaphragm_area: 1.0\nviscous_friction: -1", "viscous_friction must not be negative"),
    ("diaphragm_area: 1.0\ncoulomb_friction: -1", "coulomb_friction must not be negative"),
    ("diaphragm_area: 1.0\nstatic_friction: -1", "static_friction must not be negative"),
    ("diaphragm_area: 1.0\nspring_constant: .inf", "spring_constant must be finite, got inf"),
    ("diaphragm_area: 1.0\nspring_preload: .nan", "spring_preload must be finite, got nan"),
    ("diaphragm_area: 1.0\nlimit_velocity: -1", "limit_velocity must not be negative"),
    (
        "diaphragm_area: 1.0\ncoulomb_friction: 6\nstatic_friction: 5",
        "static_friction (5) must not be below coulomb_friction (6)",
    ),
]


@pytest.mark.parametrize(("text", "message"), BROKEN)
def test_broken_rules(write, text, message):
    path = write(text + "\n")
    with pytest.raises(ValueError, match=r"\A.*\Z") as refusal:  # one line
        read_valve_file(path)
    assert str(refusal.value).startswith(f"{path}: {message}")


def test_unreadable(tmp_path, write):
    for path, cause in (
        (tmp_path / "none.yaml", "No such file or directory"),
        (tmp_path, "Is a directory"),
    ):
        with pytest.raises(ValueError, match=r"\A.*\Z") as refusal:
            read_valve_file(path)
        assert str(refusal.value) == f"{path}: cannot be read: {cause}"
    path = write("")
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"valve.yaml: cannot be read: 'utf-8' codec"):
        read_valve_file(path)


CONFIG = Path(__file__).resolve().parents[2] / "config"
PLANT = """/**:
  ros__parameters:
    diaphragm_area: 0.0445
    travel: 0.03
    window: 30.0
    use_sim_time: false
/fv_101/identifier:
  ros__parameters: {travel: 0.04, fixed.mass: 1.7}
/fv_102:
  identifier:
    ros__parameters:
      fixed: {mass: 1.8}
  simulator:
    ros__parameters: {diaphragm_area: 0.1}
"""


@pytest.mark.parametrize("name", ["bench_low", "bench_high", "monitor"])
def test_the_files_of_the_package(name):
    found = read_valve_file(CONFIG / f"{name}.yaml")
    assert found.valve.diaphragm_area == BENCH_VALVE.diaphragm_area
    assert found.known["mass"] == 1.6
    assert found.settings.get("position_bias") == (None if name == "monitor" else 0.00113)


def test_what_all_share_and_what_is_ones_own(write):
    path = write(PLANT)
    first, second = (read_valve_file(path, name) for name in ("fv_101", "/fv_102"))
    assert (first.valve.travel, second.valve.travel) == (0.04, 0.03)
    assert (first.settings["fixed.mass"], second.settings["fixed.mass"]) == (1.7, 1.8)
    assert second.valve.diaphragm_area == 0.0445
    with pytest.raises(ValueError, match=r"fv_101, fv_102\): choose one with --valve-name"):
        read_valve_file(path)


def test_what_stands_for_nothing(write):
    path = write("diaphragm_area: 0.04\nderivative_window: 0\nfixed: {mass: .nan}\nwindow: 60.0\n")
    found = read_valve_file(path)
    assert dict(found.settings) == {}
    assert dict(found.known) == {}


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
def test_no_part_of_it_stays_and_what_was_there_does(tmp_path):
    path = tmp_path / "picture.png"
    with pytest.raises(OSError, match="No space left") as raised:
        write_whole(path, b"content")
    assert raised.value.filename == str(path)
    assert names(tmp_path) == set()
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
