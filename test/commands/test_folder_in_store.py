# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify-folder` on folders in object stores."""

import logging
import shutil
import sys

import numpy as np
import pytest
from bags import messages_of, write_bag
from documentation import PROJECT
from kept_rows import rows_of

from valve_friction_ros.commands import identify_folder
from valve_friction_ros.commands.main import run
from valve_friction_ros.fleet import find_recordings
from valve_friction_ros.records.files import on_disk, place

fsspec = pytest.importorskip("fsspec", reason="run `make venv-cluster`")
pytest.importorskip("upath", reason="run `make venv-cluster`")

EXAMPLES = PROJECT / "examples"
SHORT = (EXAMPLES / "five_seconds.csv").read_text()


@pytest.fixture
def folder(tmp_path, quick_record):
    """A folder with a table, a bag of a file and a half, and valve files."""
    plant = tmp_path / "plant"
    (plant / "unit 1").mkdir(parents=True)
    (plant / "unit 1" / "a#1.csv").write_text(SHORT)
    shutil.copy(EXAMPLES / "fv_101.yaml", plant / "unit 1" / "a#1.valve.yaml")
    write_bag(plant / "bag", messages_of(quick_record, ""))
    (plant / "bag" / "valve.yaml").write_text("diaphragm_area: 0.0445\n")
    (plant / "bag" / "more").mkdir()
    (plant / "bag" / "more" / "inner.csv").write_text(SHORT)
    columns = np.c_[np.arange(1000) / 100, quick_record.pressure, quick_record.position]
    np.savetxt(plant / "force.csv", columns, "%.9g", ",", header="time_s,force_n,position_m",
               comments="")  # fmt: skip
    (plant / "broken.csv").write_text("time_s,force_n,position_m\n0,abc,1\n")
    (plant / ".hidden.csv").write_text("")
    (plant / "notes.txt").write_text("about the plant")
    return plant


@pytest.fixture(scope="module")
def server():
    """An S3 server of this machine, with the keys to it in the environment."""
    moto = pytest.importorskip("moto.server", reason="run `make venv-test`")
    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    found = moto.ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    found.start()
    host, port = found.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        address = f"http://{host}:{port}"
        for name, value in (("KEY", "key"), ("SECRET", "secret"), ("ENDPOINT_URL", address)):
            patch.setenv(f"FSSPEC_S3_{name}", value)
        patch.setattr(fsspec.config, "conf", {})
        fsspec.config.set_conf_env(fsspec.config.conf)
        fsspec.filesystem("s3").mkdir("plants")
        yield
    found.stop()


@pytest.fixture
def stored(server, folder):  # noqa: ARG001
    """The folder in the store, by its name there."""
    store = fsspec.filesystem("s3")
    store.put(str(folder), "plants/north", recursive=True)
    yield "s3://plants/north"
    store.rm("plants/north", recursive=True)


@pytest.fixture
def arguments(stored, tmp_path):
    options = ("--output", tmp_path / "friction.csv", "--method", "bench", "--jobs", "1")
    return ("identify-folder", stored, *options)


def test_the_rows_of_the_folder_on_disk(arguments, stored, folder, tmp_path, command, capsys):
    """Also with its valve files, a bag, and a force that needs none; then only what changed."""
    code = run([*map(str, arguments)])  # a process of its own has to find the store, too
    out, err = capsys.readouterr()
    assert code == 1, err
    here = tmp_path / "here.csv"
    local = command("identify-folder", folder, "--output", here, *arguments[4:])
    assert local == (code, *(text.replace(stored, str(folder)) for text in (out, err)))
    rows, of_disk = rows_of(arguments[3]), rows_of(here)
    assert all(row.pop("content") for row in (*rows.values(), *of_disk.values()))
    assert rows == of_disk
    assert rows.keys() == {"bag", "broken.csv", "force.csv", "unit 1/a#1.csv"}
    assert {name for name, row in rows.items() if row["error"]} == {"broken.csv"}
    assert "skipped, not recordings: .hidden.csv, notes.txt" in err

    fsspec.filesystem("s3").pipe("plants/north/broken.csv", SHORT.encode())
    _, _, err = command(*arguments)
    assert "4 recordings: 3 done before, 1 to do, 1 of them again" in err


def test_an_object_that_cannot_be_read_is_a_row(arguments, command, monkeypatch):
    finished = identify_folder.finished

    def vanished(*words):
        fsspec.filesystem("s3").rm("plants/north/force.csv")
        return finished(*words)

    monkeypatch.setattr(identify_folder, "finished", vanished)
    code, _, err = command(*arguments)
    assert code == 1, err
    errors = {name: row["error"] for name, row in rows_of(arguments[3]).items() if row["error"]}
    assert errors.pop("force.csv") == "cannot be read: The specified key does not exist."
    assert errors.keys() == {"broken.csv"}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("s3://plants/nowhere", "s3://plants/nowhere: no such folder"),
        ("s3://nobodys/north", "s3://nobodys/north: no such folder"),
        ("odd://plants/north", "odd://plants/north: no such store: "),
    ],
)
def test_no_such_folder(arguments, refused, name, message):
    assert refused("identify-folder", name, *arguments[2:]).startswith(message)
    assert not arguments[3].exists()


def test_one_line_names_the_extra(arguments, refused, monkeypatch):
    monkeypatch.setitem(sys.modules, "upath", None)
    line = refused(*arguments)
    assert "S3 needs `pip install s3fs 'universal_pathlib>=0.3.10,<0.4'` (the extra `st" in line


def test_a_server_that_is_away(arguments, refused, monkeypatch):
    settings = {"s3": {"key": "k", "secret": "s", "endpoint_url": "http://127.0.0.1:9",
                       "config_kwargs": {"retries": {"max_attempts": 1}}}}  # fmt: skip
    monkeypatch.setattr(fsspec.config, "conf", settings)
    told = refused("identify-folder", "s3://elsewhere/north", *arguments[2:])
    assert "s3://elsewhere/north: " in told


def test_other_stores_by_their_names():
    """What lies in a bag below its own files stays there; no key leads out of the copy's folder."""
    store = fsspec.filesystem("memory")
    names = ("a.csv", "bag/metadata.yaml", "bag/x.mcap", "bag/more/y.csv", "bag/../../z.mcap")
    for name in names:
        store.pipe(f"/plants/{name}", b"rosbag2_bagfile_information" if "meta" in name else b"1")
    found = find_recordings(place("memory://plants")).recordings
    assert {each.name for each in found} == {"a.csv", "bag"}
    (bag,) = (each for each in found if each.name == "bag")
    state = bag.content()
    with on_disk(bag.path) as copy:
        assert sorted(each.name for each in copy.iterdir()) == ["metadata.yaml", "x.mcap"]
        assert [*copy.parent.iterdir()] == [copy]
    assert not copy.exists()
    store.pipe("/plants/bag/x.mcap", b"22")
    assert bag.content() != state
