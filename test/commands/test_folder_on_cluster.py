# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify-folder` on the workers of a Dask cluster."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from dask_workers import identify, local_cluster
from documentation import PROJECT
from kept_rows import kept, rows_of
from local_server import certificate_pair
from processes import PATIENCE, ran, wait_until

from valve_friction_ros.commands import identify_folder
from valve_friction_ros.fleet import workers

distributed = pytest.importorskip("distributed", reason="run `make venv-cluster`")
dask = pytest.importorskip("dask")

pytestmark = pytest.mark.timeout(300)  # processes start, die and come back
FAULTY = Path(__file__).with_name("faulty_cluster.py")
SHORT = (PROJECT / "examples" / "five_seconds.csv").read_text()


@pytest.fixture(scope="module")
def address():
    with local_cluster() as found:
        yield found.scheduler_address


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "plant").mkdir()
    shutil.copy(PROJECT / "examples" / "fv_101.yaml", tmp_path / "plant" / "valve.yaml")
    return tmp_path / "plant"


@pytest.fixture
def arguments(folder, tmp_path):
    return (folder, "--output", tmp_path / "friction.csv", "--method", "bench")


def test_the_rows_and_reports_of_the_local_run(address, folder, tmp_path, command, monkeypatch):
    """To the last digit, also of a folder that is named from here."""
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b"):
        (folder / f"{name}.csv").write_text(SHORT)
    texts = []
    for name, how in (("here", ("--jobs", "1")), ("there", ("--scheduler", address))):
        (tmp_path / name).mkdir()
        output = tmp_path / name / "friction.csv"
        outputs = ("--output", output, "--output", output.with_suffix(".html"))
        code, out, err = command("identify-folder", "plant", *outputs, "--method", "bench", *how)
        assert code == 0, err
        reports = sorted((tmp_path / name / "friction_reports").iterdir())
        assert len(reports) == 2
        pages = [report.read_text() for report in reports]
        texts.append((sorted(output.read_text().splitlines()), [*map(len, pages)], out))
    assert texts[0][0] == texts[1][0]
    assert texts[0][2] == texts[1][2]


def test_a_killed_worker_is_a_row(address, folder, arguments, command, monkeypatch):
    for name in ("a", "deadly", "f"):
        (folder / f"{name}.csv").write_text(SHORT)
    (folder / "broken.csv").write_text("nonsense")
    with monkeypatch.context() as patch:
        patch.setattr(identify_folder, "identify_job_elsewhere", identify)
        code, _, err = command("identify-folder", *arguments, "--scheduler", address)
    assert code == 1, err
    rows = rows_of(arguments[2])
    assert {name for name, row in rows.items() if row["error"]} == {"deadly.csv", "broken.csv"}
    assert "its worker process died 1 time," in rows["deadly.csv"]["error"]
    assert rows["broken.csv"]["error"].startswith("only one column")
    code, _, err = command("identify-folder", *arguments, "--scheduler", address)
    assert "4 recordings: 4 done before, 0 to do" in err
    code, _, err = command("identify-folder", *arguments, "--jobs", "1", "--retry-failed")
    assert "4 recordings: 2 done before, 2 to do, 2 of them again" in err
    assert {name for name, row in rows_of(arguments[2]).items() if row["error"]} == {"broken.csv"}


def test_interrupted_and_resumed(address, folder, arguments, command):
    """What is handed out is given up, and done when the same command goes on."""
    for name in ("a", "b", "endless", "f"):
        (folder / f"{name}.csv").write_text(SHORT)
    output = arguments[2]
    process = subprocess.Popen(
        [sys.executable, FAULTY, "identify-folder", *arguments, "--scheduler", address],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )

    wait_until(lambda: kept(output) == 2)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (130, "")
    assert err.splitlines()[-1].endswith("run the same command to continue")
    assert "interrupted with 2 of 4 recordings" in err
    (folder / "go").touch()
    code, _, err = command("identify-folder", *arguments, "--scheduler", address)
    assert "4 recordings: 2 done before, 2 to do" in err
    assert code == 0, err
    assert len(rows_of(output)) == 4


def test_what_a_worker_does_not_see(address, folder, arguments, command, monkeypatch):
    (folder / "a.csv").write_text(SHORT)
    found = identify_folder.finished

    def vanished(*words):
        (folder / "a.csv").unlink()
        return found(*words)

    monkeypatch.setattr("valve_friction_ros.commands.identify_folder.finished", vanished)
    code, _, err = command("identify-folder", *arguments, "--scheduler", address)
    assert code == 2
    assert "a.csv does not exist on " in rows_of(arguments[2])["a.csv"]["error"]
    assert "give all workers the folder under this path" in err


def test_a_worker_without_the_package(folder, arguments, refused, tmp_path):
    (folder / "a.csv").write_text(SHORT)
    (tmp_path / "missing").mkdir()
    (tmp_path / "missing" / "valve_friction_ros.py").write_text(
        "raise ModuleNotFoundError(\"No module named 'valve_friction_ros'\")\n"
    )
    with local_cluster(workers=0) as empty:
        worker = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", empty.scheduler_address],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(tmp_path / "missing")},
            stderr=subprocess.DEVNULL,
        )
        try:
            line = refused("identify-folder", *arguments, "--scheduler", empty.scheduler_address)
        finally:
            worker.terminate()
            worker.wait(PATIENCE)
    assert "a worker differs from this machine (tcp://" in line
    assert "No module named 'valve_friction_ros'): install valve_friction_ros " in line
    assert not arguments[2].exists()


def test_certificates_of_dask_configuration(
    folder, arguments, command, refused, tmp_path, monkeypatch
):
    (folder / "a.csv").write_text(SHORT)
    certificate, key = map(str, certificate_pair(tmp_path))
    parts = {f"tls_{part}_{what}": value for part in ("scheduler", "worker", "client")
             for what, value in (("cert", certificate), ("key", key))}  # fmt: skip
    security = distributed.Security(require_encryption=True, tls_ca_file=certificate, **parts)
    monkeypatch.setattr(workers, "_AWAY", 3.0)
    with local_cluster(protocol="tls://", security=security, host="localhost") as secure:
        address = secure.scheduler_address
        assert address.startswith("tls://")
        for other in (address, address.replace("tls://", "tcp://")):
            told = refused("identify-folder", *arguments, "--scheduler", other)
            assert f"{other}: no scheduler answers: " in told
        tls = "distributed.comm.tls"
        settings = {f"{tls}.ca-file": certificate,
                    f"{tls}.client.cert": certificate, f"{tls}.client.key": key}  # fmt: skip
        with dask.config.set(settings):
            code, _, err = command("identify-folder", *arguments, "--scheduler", address)
        assert code == 0, err


def test_refused_at_once(arguments, refused, monkeypatch):
    monkeypatch.setattr(workers, "_AWAY", 0.5)
    away = ("identify-folder", *arguments, "--scheduler", "tcp://127.0.0.1:9")
    assert refused(*away).startswith("tcp://127.0.0.1:9: no scheduler answers: ")
    assert refused(*away, "--jobs", "2").startswith("--jobs applies to this machine only: ")
    monkeypatch.setitem(sys.modules, "distributed", None)
    told = "run `pip install 'distributed>=2026.8'` (the extra `cluster`)"
    assert told in refused(*away)
    assert not arguments[2].exists()


def test_dask_is_imported_for_a_scheduler_only():
    code = "import valve_friction_ros.commands.identify_folder, sys; print(*sys.modules)"
    code, out, err = ran(program=["-c", code], cwd=PROJECT)
    assert code == 0, err
    assert not {"dask", "distributed", "fsspec", "upath"} & set(out.split())
