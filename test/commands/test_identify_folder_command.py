# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify-folder`: many recordings, interrupted and resumed."""

import gzip
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bags import messages_of, write_bag
from kept_rows import csv_rows, kept, rows_of, run_here
from processes import PATIENCE, wait_until
from records import simulated

from valve_friction_ros.identification import IdentificationSettings, identify_bench
from valve_friction_ros.model import (
    HIGH_FRICTION,
    SensorNoise,
    SquareWave,
    converter_response,
)
from valve_friction_ros.records.recordings import read_recordings
from valve_friction_ros.records.valve_file import read_valve_file

PERIOD = 0.01
FAULTY = Path(__file__).with_name("faulty_fleet.py")


@pytest.fixture(scope="module")
def short_record():
    """Twenty seconds of a square wave at 100 Hz: enough to be identified."""
    pressure = converter_response(SquareWave().sample(np.arange(0, 20, PERIOD)), PERIOD)
    return simulated(pressure, PERIOD, HIGH_FRICTION)


@pytest.fixture(scope="module")
def noisy(short_record):
    """Function of a seed: the record as noisy sensors see it."""
    return lambda seed: SensorNoise(10e-6, 100.0, seed).applied_to(short_record)


def csv_text(record):
    rows = zip(
        np.round(record.start_time + record.time, 9), record.position, record.pressure, strict=True
    )
    lines = [f"{time!r},{x!r},{p!r}\n" for time, x, p in (map(float, row) for row in rows)]
    return "time_s,position_m,pressure_pa\n" + "".join(lines)


@pytest.fixture(scope="module")
def texts(noisy):
    return [csv_text(noisy(seed)) for seed in range(8)]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "plant").mkdir()
    return tmp_path / "plant"


@pytest.fixture
def output(tmp_path):
    return tmp_path / "friction.csv"


@pytest.fixture
def arguments(folder, output, bench_yaml):
    options = ["--output", str(output), "--valve", str(bench_yaml), "--jobs", "1"]
    options += ["--method", "bench"]
    return ["identify-folder", str(folder), *options]


def start(arguments, script=None):
    """Start the command in a process group of its own, as a shell does."""
    how = [str(script)] if script else ["-m", "valve_friction_ros"]
    return subprocess.Popen(
        [sys.executable, *how, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def run(arguments, script=None):
    """Run the command as a process, which starts more of them."""
    process = start(arguments, script)
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, err


def done(path):
    return Counter((row["recording"], row["valve"]) for row in csv_rows(path))


def children(process):
    return Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.fixture
def fleet(folder, texts):
    """Six good recordings; with one process, the fourth is met after three."""
    for number, name in enumerate(("a", "b", "c", "endless", "f", "g")):
        (folder / f"{name}.csv").write_text(texts[number])
    return [("endless.csv", ""), *((f"{name}.csv", "") for name in "abcfg")]


def interrupted(arguments, output, kill):
    """Run until the third row is there and the fourth is being worked on; then `kill`."""
    process = start(arguments, FAULTY)
    wait_until(lambda: kept(output) == 3)
    workers = children(process)
    kill(process)
    out, err = process.communicate(timeout=PATIENCE)
    wait_until(lambda: not any(is_alive(pid) for pid in workers))
    return process.returncode, out, err


def test_a_folder_of_everything(folder, output, arguments, texts, noisy, bench_yaml):
    (folder / "unit_1").mkdir()
    (folder / "unit_1" / "one.csv").write_text(texts[0])
    with gzip.open(folder / "packed.csv.gz", "wt") as stream:
        stream.write(texts[1])
    streams = [*messages_of(noisy(2)), *messages_of(noisy(3), "/fv_102")]
    write_bag(folder / "bag", sorted(streams, key=lambda message: message[2]))
    (folder / "broken.csv").write_text("time_s,position_m,pressure_pa\n0,abc,1\n")
    (folder / "notes.txt").write_text("about the plant")
    (folder / ".hidden.csv").write_text(texts[0])
    code, out, err = run([*arguments, "--jobs", "2"])
    assert code == 1, err
    tables = ("broken.csv", "packed.csv.gz", "unit_1/one.csv")
    valves = [("bag", "/fv_101"), ("bag", "/fv_102"), *((name, "") for name in tables)]
    assert done(output) == Counter(valves)
    assert "skipped, not recordings: .hidden.csv, notes.txt" in err
    assert "broken.csv: row 2, column 'position_m': 'abc' is not a valid value" in err
    counts = [line.split() for line in out.splitlines()[1:3]]
    assert counts == [["identified", "4"], ["refused", "1"]]
    assert "1 refused: row …, column '…': '…' is not a valid value" in out
    assert "(for example broken.csv)" in out

    rows, description = rows_of(output), read_valve_file(bench_yaml)
    broken = rows.pop("broken.csv")
    assert (broken["error"] != "", broken["coulomb_friction_n"]) == (True, "")
    for name, row in rows.items():
        recordings = read_recordings(folder / name, description.valve)
        (recorded,) = (each for each in recordings if each.name == row["valve"])
        settings = IdentificationSettings(assumed_mass=description.known["mass"])
        result = identify_bench(recorded.recording(), description.valve, settings)
        friction = result.parameters["coulomb_friction"]
        # The worker's libraries have one thread, which may change the order of a sum.
        assert float(row["coulomb_friction_n"]) == pytest.approx(friction.value, rel=1e-9)
        assert row["coulomb_friction_verdict"] == friction.verdict.value
        assert float(row["rms_m"]) == pytest.approx(result.rms, rel=1e-9)
        assert (row["samples"], row["duration_s"]) == ("2000", "19.99")


def test_the_default_method_with_a_gap(folder, noisy, tmp_path, bench_yaml):
    """Its row names the method that was used; what other methods do not have is there too."""
    output = tmp_path / "friction.jsonl"
    head, *lines = csv_text(noisy(0)).splitlines()
    (folder / "whole.csv").write_text("\n".join([head, *lines]))
    (folder / "broken.csv").write_text("\n".join([head, *lines[:700], *lines[740:]]))
    arguments = ["identify-folder", str(folder), "--output", str(output), "--jobs", "1"]
    assert run_here([*arguments, "--valve", str(bench_yaml)]) == 0
    rows = {row["recording"]: row for row in map(json.loads, output.open())}
    for row in rows.values():
        assert (row["method"], row["error"]) == ("plant", None)
        error = abs(row["coulomb_friction_n"] - HIGH_FRICTION.coulomb_friction)
        assert error < row["coulomb_friction_half_width_n"]
        assert row["sliding_friction_n"] > row["coulomb_friction_n"]
    assert "gap" in rows["broken.csv"]["warnings"]
    assert "gap" not in (rows["whole.csv"]["warnings"] or "")


def test_killed_and_resumed(fleet, output, arguments, capsys):
    code, _, _ = interrupted(arguments, output, lambda process: process.kill())
    assert code == -signal.SIGKILL
    assert kept(output) == 3
    assert run_here(arguments) == 0
    out, err = capsys.readouterr()
    assert "6 recordings: 3 done before, 3 to do" in err
    assert [*rows_of(output)][:3] == ["a.csv", "b.csv", "c.csv"]
    assert done(output) == Counter(fleet)
    assert ["identified", "6"] in [line.split() for line in out.splitlines()]


def test_a_page_against_baselines(folder, texts, tmp_path, output, arguments, capsys):
    """The valve whose friction has doubled stands first; each has its picture and its report."""
    strange = "<b>='x'&.csv"
    for name, text in zip(["a.csv", "=b.csv", strange], texts, strict=False):
        (folder / name).write_text(text)
    (folder / "refused.csv").write_text("time_s,position_m,pressure_pa\n0,<i>,1\n")
    healthy = tmp_path / "healthy.csv"
    healthy.write_text(f"recording,coulomb_friction_n\na.csv,606\n'=b.csv,250\n{strange},450\n")
    page = output.with_suffix(".html")
    arguments += ["--output", str(page), "--baselines", str(healthy), "--fail-on", "warn"]
    assert run_here(arguments) == 3
    out, err = capsys.readouterr()
    assert "baselines: 3 of 4 recordings have one" in err
    alarms = [line.split(": ")[0] for line in out.splitlines() if "times its baseline" in line]
    assert alarms == [" ERROR =b.csv", f"  WARN {strange}"]

    rows = rows_of(output)
    assert float(rows["'=b.csv"]["ratio"]) == pytest.approx(606 / 250, rel=0.02)
    assert rows["a.csv"]["level"] == "OK"
    text = page.read_text(encoding="utf-8")
    names = ["=b.csv", "&lt;b&gt;=&#39;x&#39;&amp;.csv", "a.csv", "refused.csv"]
    places = [text.index(f'data-key="{name}"') for name in names]
    assert places == sorted(places)
    assert text.count("<polyline") == 3
    links = re.findall('<a href="([^"]+)"', text)
    assert len(links) == 3
    for link in links:
        report = (page.parent / link).read_text(encoding="utf-8")
        assert "times its baseline" in report
        assert "<b>" not in report
    assert "column &#39;position_m&#39;: &#39;&lt;i&gt;&#39; is not a valid value" in text

    # A report that is gone is written again, and nothing else is done.
    (page.parent / links[0]).unlink()
    assert run_here(arguments) == 3
    assert "3 done before, 1 to do, 1 of them again" in capsys.readouterr().err
    assert (page.parent / links[0]).is_file()
    healthy.write_text("recording,coulomb_friction_n\nelsewhere.csv,606\n")
    assert run_here(arguments) == 2
    assert "no recording of" in capsys.readouterr().err


def test_only_the_newest_diagnosis_of_a_tag_fails_the_command(
    folder, noisy, tmp_path, output, capsys
):
    """A valve that was repaired is no alarm; a refused record does not end one."""
    still = replace(noisy(2), position=np.full_like(noisy(2).position, 0.01))
    for month, record in enumerate((noisy(0), noisy(1), still), start=1):
        text = csv_text(replace(record, start_time=1.7e9 + 2.6e6 * month))
        (folder / f"FV-1 {month}.csv").write_text(text)
    plant, healthy = tmp_path / "plant.csv", tmp_path / "healthy.csv"
    plant.write_text("tag,area,travel,reference\nFV-1,445 cm2,28.575 mm,41.74 kPa\n")
    arguments = ["identify-folder", str(folder), "--output", str(output), "--method", "bench"]
    arguments += ["--plant", str(plant), "--baselines", str(healthy), "--fail-on", "warn"]
    arguments += ["--jobs", "1", "--redo"]
    lines = "recording,coulomb_friction_n\nFV-1 1.csv,{}\nFV-1 2.csv,{}\n"
    for first, second, code in ((250, 606, 1), (606, 250, 3)):
        healthy.write_text(lines.format(first, second))
        assert run_here(arguments) == code
        out, err = capsys.readouterr()
        assert ("times its baseline" in out) == (code == 3), (out, err)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupted(fleet, output, arguments, number, code):
    """Ctrl-C goes to all processes of the group; so may a SIGTERM."""
    found, out, err = interrupted(arguments, output, lambda process: os.killpg(process.pid, number))
    assert (found, out) == (code, "")
    assert "Traceback" not in err
    assert "interrupted with 3 of 6 recordings" in err
    assert "run the same command to continue" in err
    assert len(done(output)) == 3
    assert set(done(output)) < set(fleet)


def test_a_process_that_dies_costs_its_recording_only(folder, texts, output, arguments, capsys):
    for name in ("a", "b", "deadly", "e", "f"):
        (folder / f"{name}.csv").write_text(texts[0])
    code, _, err = run([*arguments, "--jobs", "2"], FAULTY)
    assert code == 1, err
    errors = {name: row["error"] for name, row in rows_of(output).items()}
    assert {name for name, error in errors.items() if error} == {"deadly.csv"}
    assert "killed by SIGKILL" in errors["deadly.csv"]
    assert len(errors) == 5

    assert run_here([*arguments, "--retry-failed"]) == 0
    assert "5 recordings: 4 done before, 1 to do, 1 of them again" in capsys.readouterr().err
    assert max(done(output).values()) == 1


def test_only_what_changed_is_done_again(folder, texts, output, arguments, capsys):
    names = ["a.csv", "b.csv", "c.csv"]
    for name, text in zip(names, texts, strict=False):
        (folder / name).write_text(text)
    (folder / "c.csv").write_text("nonsense")
    assert run_here(arguments) == 1
    first = rows_of(output)
    (folder / "b.csv").write_text(texts[5])
    capsys.readouterr()
    assert run_here(arguments) == 1
    assert "3 recordings: 2 done before, 1 to do, 1 of them again" in capsys.readouterr().err
    second = rows_of(output)
    assert list(second) == ["a.csv", "c.csv", "b.csv"]
    assert (second["a.csv"], second["c.csv"]) == (first["a.csv"], first["c.csv"])
    assert second["b.csv"]["coulomb_friction_n"] != first["b.csv"]["coulomb_friction_n"]

    state = output.read_bytes()
    assert run_here(arguments) == 1
    assert output.read_bytes() == state


def test_other_options_are_not_mixed_in_silence(folder, texts, output, arguments, capsys):
    (folder / "a.csv").write_text(texts[0])
    assert run_here(arguments) == 0
    state = output.read_bytes()
    capsys.readouterr()
    assert run_here([*arguments, "--fix", "mass=1.6"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "1 recordings in it were identified with other options" in line
    assert output.read_bytes() == state
    assert run_here([*arguments, "--fix", "mass=1.6", "--redo"]) == 0
    (row,) = rows_of(output).values()
    assert (row["mass_kg"], row["mass_verdict"]) == ("1.6", "fixed")


def test_valve_files_beside_recordings(folder, texts, noisy, tmp_path, bench_yaml):
    """The nearest description counts; JSON lines hold the same columns."""
    output = tmp_path / "friction.jsonl"
    double = bench_yaml.read_text().replace("0.0445", "0.089")
    for name in ("alone", "own"):
        (folder / name).mkdir()
        (folder / name / "a.csv").write_text(texts[0])
    write_bag(folder / "own" / "saved", messages_of(noisy(0), ""))
    (folder / "own" / "saved" / "valve.yaml").write_text(bench_yaml.read_text())
    (folder / "own" / "valve.yaml").write_text(double)
    (folder / "own" / "b.csv").write_text(texts[0])
    (folder / "own" / "b.valve.yaml").write_text("diaphragm_area: none")
    assert run_here(["identify-folder", str(folder), "--output", str(output), "--jobs", "1"]) == 1
    rows = {row["recording"]: row for row in map(json.loads, output.open())}
    assert "pressure needs the diaphragm_area" in rows["alone/a.csv"]["error"]
    assert "b.valve.yaml: diaphragm_area must be a number" in rows["own/b.csv"]["error"]
    twice = rows["own/a.csv"]["coulomb_friction_n"] / rows["own/saved"]["coulomb_friction_n"]
    assert twice == pytest.approx(2, rel=0.01)

    shutil.copy(bench_yaml, folder / "alone" / "a.valve.yaml")  # mended: no --redo is asked for
    assert run_here(["identify-folder", str(folder), "--output", str(output), "--jobs", "1"]) == 1
    rows = {row["recording"]: row for row in map(json.loads, output.open())}
    assert rows["alone/a.csv"]["error"] is None
    assert len(rows) == 4


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--jobs", "0"], "--jobs must be at least 1"),
        (["--fix", "mass=heavy"], "'heavy' is not a number"),
        (["--output", "friction.xlsx"], "must end in .csv, .jsonl, .html"),
        (["--output", "nowhere/friction.csv"], "there is no folder nowhere"),
        (["--order", "1"], "order must be at least 2"),
        (["--valve", "nowhere.yaml"], "nowhere.yaml: cannot be read"),
        ([], "contains no tables (CSV, xlsx, Parquet) and no bags"),
    ],
)
def test_bad_arguments_are_refused_at_once(arguments, output, refused, extra, message):
    assert message in refused(*arguments, *extra)
    assert not output.exists()


def test_the_output_may_lie_among_the_recordings(folder, texts, bench_yaml, capsys):
    (folder / "a.csv").write_text(texts[0])
    arguments = ["identify-folder", str(folder), "--output", str(folder / "out.csv")]
    arguments += ["--valve", str(bench_yaml), "--jobs", "1"]
    assert run_here(arguments) == 0
    assert run_here(arguments) == 0
    assert done(folder / "out.csv") == Counter([("a.csv", "")])
    assert "skipped" not in capsys.readouterr().err
    assert run_here([*arguments[:3], str(folder / "a.csv"), *arguments[4:]]) == 2
    assert (folder / "a.csv").read_text() == texts[0]


@pytest.mark.parametrize("name", ["friction.csv", "friction.jsonl"])
def test_a_recording_that_cannot_be_begun_is_not_tried_again(folder, texts, tmp_path, capsys, name):
    (folder / "a.csv").write_text(texts[0])  # a pressure, and no valve file
    arguments = ["identify-folder", str(folder), "--output", str(tmp_path / name)]
    assert run_here(arguments) == 2
    assert "a.csv: pressure needs the diaphragm_area" in capsys.readouterr().err
    assert run_here(arguments) == 2
    assert "1 recording: 1 done before, 0 to do" in capsys.readouterr().err
    assert run_here([*arguments, "--retry-failed"]) == 2
    assert "1 to do, 1 of them again" in capsys.readouterr().err
