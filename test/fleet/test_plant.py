# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A folder is a plant: exports of several forms, one table of valves, a history by tag and time."""

import contextlib
import io
import math
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from browser import Tab, chromium
from kept_rows import rows_of, run_here
from local_server import free_port

from valve_friction_ros import history
from valve_friction_ros.commands.main import run
from valve_friction_ros.dashboard import Plant
from valve_friction_ros.dashboard.context import ValveFiles
from valve_friction_ros.dashboard.history_cache import KeptValves
from valve_friction_ros.dashboard.plant_rows import state_of, state_words
from valve_friction_ros.fleet.job import kept_valve
from valve_friction_ros.fleet.recordings import read_plant, tags_in
from valve_friction_ros.health import AlarmAction, AlarmError, AlarmKind, AlarmRequest
from valve_friction_ros.history import AlarmFilter, HistoryFile, read_alarms, request_alarms
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SensorNoise, SineWave, simulate
from valve_friction_ros.model.recording import Recording

TABLE = "tag;area [cm2];travel [mm];spring;range\n" + "".join(
    f"FV-10{number};445;28.575;0.2..1.4 bar;-0.1..4 bar\n" for number in (1, 2, 3)
)
BERLIN = ("--time-zone", "Europe/Berlin", "--fix", "mass=1.6")
GROWTH = 0.2
"""Of the friction, a quarter."""
MONTHS = ((2025, 7), (2025, 10), (2026, 1), (2026, 4), (2026, 7))
QUARTERS = [datetime(year, month, 3, 8, tzinfo=timezone.utc) for year, month in MONTHS]


def stroke(friction, seed, share=1.0):
    """Twenty seconds of a sine at 100 Hz, or a share of it; pressure as gauge."""
    pressure = SineWave(period=10.0).sample(np.arange(2000) / 100)
    pressure = pressure.mean() + share * (pressure - pressure.mean())
    packing = replace(LOW_FRICTION, coulomb_friction=friction, static_friction=friction)
    stem = simulate(BENCH_VALVE, packing, pressure, 0.01).position
    noisy = SensorNoise(2e-6, 20.0, seed=seed).applied_to(Recording(0.01, pressure, stem))
    return noisy.pressure - BENCH_VALVE.pressure_reference, noisy.position


def german(begin, pressure, position):
    rows = ["Zeit;Stelldruck (bar);Ventilstellung (%)"]
    for index, (one, other) in enumerate(zip(pressure, position, strict=True)):
        time = begin + timedelta(milliseconds=10 * index)
        share = 100 * other / BENCH_VALVE.travel
        fraction = time.microsecond // 1000
        rows.append(f"{time:%d.%m.%Y %H:%M:%S},{fraction:03d};{one / 1e5:.5f};{share:.4f}")
    head, *others = rows
    return "\n".join([head, *(re.sub(r";(-?\d+)\.(\d+)", r";\1,\2", row) for row in others)])


def long_form(begin, tag, pressure, position):
    rows = ["Tag,Time,Value,Status"]
    for index, (one, other) in enumerate(zip(pressure, position, strict=True)):
        time = (begin + timedelta(milliseconds=10 * index)).isoformat(timespec="milliseconds")
        rows += [
            f"{tag} pressure (kPa),{time},{one / 1e3:.3f},Good",
            f"{tag} position (mm),{time},{other * 1e3:.4f},Good",
        ]
    return "\n".join(rows)


def single(begin, values):
    """A signal of 100 Hz by itself, as historians write the exports of single tags."""
    rows = ["Timestamp,Value"]
    for index, value in enumerate(values):
        time = begin + timedelta(milliseconds=10 * index)
        rows.append(f"{time:%Y-%m-%d %H:%M:%S}.{time.microsecond // 1000:03d},{value:.6f}")
    return "\n".join(rows)


def make_plant(folder, exports, table=TABLE):
    """Write the table of the valves, and exports by name."""
    (folder / "valves.csv").write_text(table)
    for name, text in exports.items():
        path = folder / "exports" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def identify(folder, *words):
    """Run `identify-folder` over the exports of a plant, into ``friction.csv``; its exit code."""
    arguments = (folder / "exports", "--plant", folder / "valves.csv")
    return run_here(["identify-folder", *arguments, "--output", folder / "friction.csv", *words])


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Five quarters of FV-101, whose packing is tightened, one of FV-102, and two bad exports."""
    folder = tmp_path_factory.mktemp("plant")
    exports = {"trend.txt": long_form(QUARTERS[-1], "FV-102", *stroke(150.0, 10))}
    for number, begin in enumerate(QUARTERS):
        grown = stroke(150.0 * (1 + GROWTH * number), number)
        exports[f"Q{number + 1}/fv101 stroke.csv"] = german(begin, *grown)
    for name in ("a", "b"):
        exports[f"FV-102 {name}.csv"] = "Time,Position,Pressure\n0,1,2\n0.1,1,2\n"
    make_plant(folder, exports)
    return folder


def identify_quarters(plant):
    return identify(
        plant, "--history", plant / "history.sqlite", "--first-is-baseline",
        "--output", plant / "friction.html", "--no-reports", *BERLIN,
    )  # fmt: skip


@pytest.fixture(scope="module")
def done(plant):
    """The code of a run, and what it printed."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = identify_quarters(plant)
    return code, out.getvalue(), err.getvalue()


def entries(plant, tag):
    history = HistoryFile(plant / "history.sqlite")
    return history.entries([kept_valve(tag).name], 0, 2**63 - 1)


def test_each_quarter_is_filed_under_its_tag_and_time(plant, done):
    """The German export has local times, the long form names UTC."""
    assert done[0] == 1
    of_first = entries(plant, "FV-101")
    assert {one.valve.tag for one in of_first} == {"FV-101"}
    local = [one.replace(tzinfo=ZoneInfo("Europe/Berlin")).timestamp() for one in QUARTERS]
    assert [one.span.begin / 1e9 for one in of_first] == pytest.approx(local, abs=1e-3)
    (other,) = entries(plant, "FV-102")
    assert other.span.begin / 1e9 == pytest.approx(QUARTERS[-1].timestamp(), abs=1e-3)


def test_the_growth_is_a_trend(plant, done):
    assert done
    ratios = [one.diagnosis.ratio.value for one in entries(plant, "FV-101")]
    assert ratios == pytest.approx([1, 1.2, 1.4, 1.6, 1.8], rel=0.05)
    levels = [one.diagnosis.level.name for one in entries(plant, "FV-101")]
    assert levels == ["OK", "OK", "WARN", "WARN", "WARN"]


def test_only_the_last_record_of_a_valve_is_an_alarm(done):
    """Three of five are: those of earlier quarters crowded other valves out of the list."""
    assert [line.split(":")[0] for line in done[1].splitlines() if " FV-101: " in line] == [
        "  WARN Q5/fv101 stroke.csv FV-101"
    ]


def test_rows_have_the_tag_the_time_and_the_ratio(plant, done):
    assert done
    row = rows_of(plant / "friction.csv")["Q5/fv101 stroke.csv"]
    assert (row["valve"], row["began"]) == ("FV-101", "2026-07-03T06:00:00Z")
    assert float(row["ratio"]) == pytest.approx(1.8, rel=0.05)
    page = (plant / "friction.html").read_text()
    assert "2026-07-03 08:00 Europe/Berlin" in page


def test_equal_faults_are_one_line(done):
    _, out, err = done
    assert err.count("cannot tell the unit of the pressure") == 1
    assert "2 refused: cannot tell the unit of the pressure" in out


def test_the_next_run_has_nothing_to_do(plant, done, capsys):
    assert done
    assert identify_quarters(plant) == 1
    assert "0 to do" in capsys.readouterr().err
    assert len(entries(plant, "FV-101")) == len(QUARTERS)


def test_a_first_survey_ranks_by_the_dead_band_and_says_what_to_do(tmp_path, capsys):
    """The dead band (F_c + F_s)/k over the travel is 5, 15 and 27 %, the limits are 10 and 20."""
    frictions = {"FV-101": 150.0, "FV-102": 800.0, "FV-103": 450.0}
    make_plant(
        tmp_path, {f"{tag}.csv": german(QUARTERS[0], *stroke(f, 1)) for tag, f in frictions.items()}
    )
    assert identify(tmp_path, *BERLIN) == 0
    out = capsys.readouterr().out
    first, second = out.index("bad FV-102.csv FV-102"), out.index("watch FV-103.csv FV-103")
    assert first < out.index("plan work on the packing") < second
    assert second < out.index("record it again within three months")
    assert "FV-101" not in out
    rows = rows_of(tmp_path / "friction.csv", "valve")
    assert [rows[tag]["survey"] for tag in sorted(rows)] == ["good", "bad", "watch"]
    shares = [float(rows[tag]["dead_band_of_travel"]) for tag in sorted(rows)]
    stiffness = LOW_FRICTION.spring_constant * BENCH_VALVE.travel
    exact = [2 * friction / stiffness for friction in frictions.values()]
    assert shares == pytest.approx(exact, rel=0.03)


def test_recordings_without_a_date_are_named(tmp_path, capsys):
    """They were missing in the history without a word, and their message came once for each."""
    rows = german(QUARTERS[0], *stroke(450.0, 1)).splitlines()
    seconds = (f"{one / 100:.2f};".replace(".", ",") for one in range(len(rows) - 1))
    undated = [
        f"{second}{row.partition(';')[2]}" for second, row in zip(seconds, rows[1:], strict=True)
    ]
    text = "\n".join(["t (s);Stelldruck (bar);Ventilstellung (%)", *undated])
    make_plant(tmp_path, {"FV-103 a.csv": text, "FV-103 b.csv": text})
    assert identify(tmp_path, "--history", tmp_path / "history.sqlite", *BERLIN) == 0
    out, err = capsys.readouterr()
    assert "2 results not filed, because the times have no date: FV-103 a.csv, FV-103 b.csv" in err
    assert out.splitlines()[0].split() == ["friction", "records"]
    assert out.splitlines()[1].split()[-1] == "2"
    assert out.count("watch FV-103 a.csv FV-103 and 1 more record: ") == 1
    assert "FV-103 b.csv" not in out


def test_files_of_single_signals_are_one_record_of_their_valve(tmp_path, capsys):
    """By their names, by the tags in the table, and by the quarter where there are several."""
    table = (
        "tag;area [cm2];travel [mm];pressure_unit;position_unit;pressure_column;position_column\n"
        "FV-101;445;28.575;bar;percent;;\n"
        "FV-102;445;28.575;bar;percent;PT-2045;ZT-17\n"
    )
    exports = {}
    for quarter, friction in enumerate((150.0, 300.0)):
        pressure, position = stroke(friction, 1)
        share = 100 * position / BENCH_VALVE.travel
        for signal, values in (("PT", pressure / 1e5), ("ZT", share), ("SP", share)):
            exports[f"FV101.{signal}_Q{quarter + 1}.csv"] = single(QUARTERS[quarter], values)
    pressure, position = stroke(200.0, 2)
    exports["PT2045.csv"] = single(QUARTERS[2], pressure / 1e5)
    exports["ZT17.csv"] = single(QUARTERS[2], 100 * position / BENCH_VALVE.travel)
    exports["FV-102.PV.csv"] = single(QUARTERS[2], position)
    make_plant(tmp_path, exports, table)
    assert identify(tmp_path, "--fix", "mass=1.6") == 0
    capsys.readouterr()
    rows = rows_of(tmp_path / "friction.csv")
    found = {name: (row["valve"], row["began"]) for name, row in rows.items()}
    times = [f"{one:%Y-%m-%dT%H:%M:%SZ}" for one in QUARTERS]
    assert found == {
        "FV101.PT_Q1.csv + FV101.SP_Q1.csv + FV101.ZT_Q1.csv": ("FV-101", times[0]),
        "FV101.PT_Q2.csv + FV101.SP_Q2.csv + FV101.ZT_Q2.csv": ("FV-101", times[1]),
        "FV-102.PV.csv + PT2045.csv + ZT17.csv": ("FV-102", times[2]),
    }
    true = dict(zip(sorted(times[:3]), (150.0, 300.0, 200.0), strict=True))
    for row in rows.values():
        coulomb, width = (float(row[f"coulomb_friction{end}_n"]) for end in ("", "_half_width"))
        assert abs(coulomb - true[row["began"]]) <= width
    assert identify(tmp_path, "--fix", "mass=1.6") == 0
    assert "0 to do" in capsys.readouterr().err


def test_equal_questions_about_files_of_single_signals_are_one_line(tmp_path, capsys):
    pressure, position = stroke(150.0, 1)
    signals = {"PT": single(QUARTERS[0], pressure / 1e5), "PV": single(QUARTERS[0], 1e3 * position)}
    tags = ("FV101", "FV102")
    make_plant(
        tmp_path, {f"{tag}.{end}.csv": text for tag in tags for end, text in signals.items()}
    )
    assert identify(tmp_path, "--pressure-unit", "bar") == 2
    out, err = capsys.readouterr()
    assert err.count("cannot tell which of") == 1
    assert (
        "FV101.PT.csv + FV101.PV.csv, FV-101: cannot tell which of 'FV101.PT.csv', 'FV101.PV.csv' "
        "is the position (--position-column 'FV101.PV'), and its unit (--position-unit)"
    ) in err
    assert "2 refused: cannot tell which of" in out


def test_the_class_of_the_packing_counts_in_the_history_and_on_its_page(tmp_path):
    """A dead band of 27 % is bad for PTFE, and to be watched for graphite."""
    make_plant(tmp_path, {"FV-102.csv": german(QUARTERS[0], *stroke(800.0, 1))})
    place = tmp_path / "history.sqlite"
    assert identify(tmp_path, "--history", place, "--packing", "graphite", *BERLIN) == 0
    assert rows_of(tmp_path / "friction.csv")["FV-102.csv"]["survey"] == "watch"
    (entry,) = entries(tmp_path, "FV-102")
    assert entry.diagnosis.message.endswith("watch, by the limits for a first survey")
    valves = Plant(math.inf)
    KeptValves(place, valves).refresh()
    (shown,) = valves.valves(1e9)
    assert state_words(shown) == "no baseline, watch"


def test_the_reports_of_a_later_run_know_the_kept_baseline(plant, done, tmp_path):
    """Titled by the tag, in the stated zone, under a name that the dashboard finds."""
    assert done
    shutil.copy(plant / "history.sqlite", tmp_path)
    make_plant(tmp_path, {"fv101.csv": (plant / "exports/Q5/fv101 stroke.csv").read_text()})
    kept = ("--history", tmp_path / "history.sqlite")
    assert identify(tmp_path, *kept, "--output", tmp_path / "q5.html", *BERLIN) == 0
    files = ValveFiles({"reports": tmp_path / "friction_reports"}).offered("/fv_101")
    (offered,) = files
    assert offered.path.startswith("fv_101_20260703T060000Z_")
    page = (tmp_path / "friction_reports" / offered.path).read_text()
    assert "<title>Friction of FV-101</title>" in page
    assert "Recorded 2026-07-03 08:00 Europe/Berlin" in page
    assert "friction has grown" in page


def test_a_history_of_the_name_of_the_output_is_refused(plant, capsys):
    """The rows of friction.csv are kept in friction.sqlite."""
    place, output = plant / "friction.sqlite", plant / "friction.csv"
    assert identify(plant, "--history", place) == 2
    assert capsys.readouterr().err == (
        f"valve_friction identify-folder: --history {place}: --output {output} keeps its rows in a "
        "file of this name: give one of the two another name\n"
    )


class TestDashboard:
    """What the dashboard makes of the history alone."""

    @pytest.fixture
    def shown(self, plant, done):
        assert done
        place, valves = plant / "history.sqlite", Plant(math.inf)
        kept = KeptValves(place, valves)
        kept.refresh()
        return place, valves, kept

    def view(self, valves):
        heard = {one.view.tag: one for one in valves.valves(1e9)}
        return heard["FV-101"]

    def test_it_shows_the_trend_and_when_the_limit_is_crossed(self, shown):
        """The truth: F_c grows by 10 N a month, from 150 N on 2025-07-03 to twice that."""
        one = self.view(shown[1])
        assert (state_of(one), one.view.signal.value) == ("warn", "M")
        assert one.view.ratio.value == pytest.approx(1 + 4 * GROWTH, rel=0.05)
        drift = one.view.drift
        assert abs(drift.value - 10.0) < drift.half_width < 5.0
        assert "2026-07" < drift.expected < "2027-01"
        assert one.view.parameter("spring_constant").value == pytest.approx(2.05e5, rel=0.01)
        assert {str(q.name) for q in one.view.baseline} == {"coulomb_friction", "sliding_friction"}

    def test_its_alarms_are_raised_at_their_record_and_are_answered(self, shown, monkeypatch):
        """The step of an alarm shows without a history being read again."""
        _, valves, kept = shown
        monkeypatch.setattr(history, "valve_histories", pytest.fail)
        request = AlarmRequest(AlarmAction.ACKNOWLEDGE, "Anna")
        asked = kept.file, kept_valve("FV-101"), AlarmKind.FRICTION_HIGH, request, time.time_ns()

        (raised,) = kept.alarms(AlarmFilter(), is_journal=True)
        local = QUARTERS[2].replace(tzinfo=ZoneInfo("Europe/Berlin")).timestamp()
        assert raised.event.time / 1e9 == pytest.approx(local + 20.0, abs=0.1)
        assert self.view(valves).view.advice == "Plan to replace the packing at the next shutdown."
        assert request_alarms(*asked).events
        with pytest.raises(AlarmError, match="cannot be acknowledged"):
            request_alarms(*asked)
        kept.refresh()
        (alarm,) = self.view(valves).view.alarms
        assert (alarm.kind.value, alarm.state.value) == ("friction_high", "acknowledged")

    def test_pages_in_a_browser_where_ros_cannot_be_imported(self, shown):
        pytest.importorskip("nicegui", reason="NiceGUI is not installed")
        port = free_port()
        arguments = [sys.executable, "-c", WITHOUT_ROS, "dashboard", str(shown[0]),
                     "--time-zone", "Europe/Berlin", "--port", str(port)]  # fmt: skip
        usual = {name: one for name, one in os.environ.items() if not name.startswith("PYTEST")}
        process = subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True, env=usual)
        with chromium() as browser:
            try:
                assert process.stderr.readline().startswith("ready: open http://127.0.0.1")
                tab = Tab(browser, f"http://127.0.0.1:{port}")
                with contextlib.closing(tab):
                    page = tab.open("/")
                    page.wait_for_selector(".vf-row")
                    assert page.locator(".vf-row").count() == 2
                    assert "1.79" in page.locator(".vf-row").first.inner_text()
                    assert "live" not in page.inner_text("table")
                    page.get_by_role("link", name="FV-101").click()
                    page.get_by_text("N per month; excess expected").wait_for()
                    assert page.title() == "FV-101 · valve friction"
                    assert "2026-07-03 08:00:19 CEST" in page.inner_text("article")
                    assert not page.get_by_role("button", name="Identify").count()
                    tab.open("/alarms").get_by_text("Plan to replace the packing").wait_for()
                    page = tab.open("/compare?a=/fv_101/identifier&b=/fv_102/identifier")
                    page.get_by_text("differs").first.wait_for()
                    # Its numbers are read: what compiles kernels (60 MB) stays away.
                    libraries = Path(f"/proc/{process.pid}/maps")
                    assert not libraries.exists() or "llvmlite" not in libraries.read_text()
            finally:
                process.terminate()
                assert "Traceback" not in process.communicate(timeout=300)[1]

    def test_what_is_no_history_is_refused(self, tmp_path, capsys):
        assert run(["dashboard", str(tmp_path / "none.sqlite")]) == 2
        assert "no such file" in capsys.readouterr().err


WITHOUT_ROS = """
import sys
import time
class Without:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("rclpy", "diagnostic_msgs", "std_srvs", "rcl_interfaces"):
            raise ImportError(f"{name} is not installed")
sys.meta_path.insert(0, Without())
from valve_friction_ros.commands.main import main
sys.exit(main())
"""


class TestTable:
    @pytest.mark.parametrize(
        ("text", "cause"),
        [
            ("tag,area\nFV-1,445 cm2\n", "row 2: FV-1: travel missing"),
            ("tag,area,travel\nFV-1,445,20 mm\n", "row 2: area: '445': there is no unit"),
            ("area,travel\n445 cm2,20 mm\n", "there is no column tag"),
            ("tag,area,travel,sprng\nA,1 cm2,2 mm,x\n", "unknown column 'sprng'; did you mean"),
            ("tag,area,travel\nA,90 cm2,20 mm\nA,90 cm2,20 mm\n", "row 3: a second A"),
            ("tag,area,travel\nA,1,2 mm\nB,1 cm2,\n", "; row 3: B: travel missing"),
        ],
    )
    def test_faults(self, tmp_path, text, cause):
        path = tmp_path / "valves.csv"
        path.write_text(text)
        with pytest.raises(ValueError, match=re.escape(cause.replace("; did", ": did"))) as refusal:
            read_plant(path)
        assert "\n" not in str(refusal.value)

    def test_a_list_of_valves_as_a_spreadsheet_saves_it(self, tmp_path):
        """In Windows' encoding, with columns that are nobody's business."""
        path = tmp_path / "valves.csv"
        text = "Tag;Einbauort;Area [cm2];Travel [mm];Prüfung\nFV-1;Kühlwasser;445;28,6;März\n"
        path.write_bytes(text.encode("cp1252"))
        valve = read_plant(path)["FV-1"].valve
        assert (valve.diaphragm_area, valve.travel) == pytest.approx((0.0445, 0.0286))

    @pytest.mark.parametrize("nothing", ["", "none", "None", "-", "n/a"])
    def test_a_valve_without_a_spring_range(self, tmp_path, nothing):
        path = tmp_path / "valves.csv"
        path.write_text(f"tag;area [cm2];travel [mm];spring;range\nFV-1;445;28.6;{nothing};-\n")
        found = read_plant(path)["FV-1"]
        assert "spring_constant" not in found.known
        assert found.valve.pressure_maximum == math.inf

    def test_what_it_says(self, tmp_path):
        path = tmp_path / "valves.csv"
        path.write_text(TABLE)
        found = read_plant(path)["FV-101"]
        assert found.valve.diaphragm_area == pytest.approx(0.0445)
        assert found.valve.pressure_maximum == pytest.approx(4e5)
        assert found.known["spring_constant"] == pytest.approx(0.0445 * 1.2e5 / 0.028575)

    def test_a_cell_may_have_its_own_unit_as_on_the_page(self, tmp_path):
        path, page = tmp_path / "valves.csv", Path(__file__).parents[2] / "doc/how_to/folder.md"
        path.write_text(re.findall(r"```text\n(tag;area.*?)```", page.read_text(), re.DOTALL)[0])
        first, second = (read_plant(path)[tag].valve for tag in ("FV-101", "FV-102"))
        assert (first.diaphragm_area, first.travel) == pytest.approx((0.069, 0.0286))
        assert (second.diaphragm_area, second.travel) == pytest.approx((0.06903212, 0.028575))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("FV-101 stroke.csv", ["FV-101"]),
        ("fv101_2026-07.csv", ["FV-101"]),
        ("FV_101.PT", ["FV-101"]),
        ("FV-1012.csv", []),
        ("XFV-101.csv", []),
        ("FV-101A.csv", ["FV-101A"]),
    ],
)
def test_tags(text, found):
    assert tags_in([text], ["FV-101", "FV-101A", "FV-10"]) == found


def test_lost_travel_stays_an_alarm_until_a_record_reaches_the_stop_again(tmp_path):
    """Nothing is repaired by a partial stroke that does not get that far."""
    pressure, position = stroke(150.0, 1)
    short = np.minimum(position, 0.6 * BENCH_VALVE.travel)
    records = (pressure, position), (pressure, short), stroke(150.0, 2, 0.2), (pressure, position)
    states = []
    for number, record in enumerate(records):
        make_plant(tmp_path, {f"FV-101 {number}.csv": german(QUARTERS[number], *record)})
        history = tmp_path / "history.sqlite"
        identify(tmp_path, "--history", history, "--first-is-baseline", *BERLIN)
        alarm = read_alarms(HistoryFile(history), kept_valve("FV-101").name).get(
            AlarmKind.WHOLE_VALVE
        )
        states.append("" if alarm is None else f"{alarm.state.value} {alarm.condition.level.name}")
        if number in (1, 2):
            assert "travel" in alarm.condition.message
    assert states == ["", *2 * ["unacknowledged WARN"], "returned unacknowledged OK"]


class TestSeizedStem:
    """Two quarters of one valve: it moves, then the same pressure swings and the stem stays."""

    @pytest.fixture(scope="class")
    def answers(self, tmp_path_factory):
        """The folder, the exit code, and what was printed."""
        folder = tmp_path_factory.mktemp("seized")
        pressure, position = stroke(150.0, 1)
        held = np.full_like(position, 0.5 * (position.min() + position.max()))
        held += np.random.default_rng(2).normal(0.0, 2e-6, held.size)
        stems = enumerate((position, held))
        make_plant(
            folder, {f"FV-101 {k}.csv": german(QUARTERS[k], pressure, stem) for k, stem in stems}
        )
        words = (
            "--history", folder / "history.sqlite", "--first-is-baseline",
            "--output", folder / "friction.html", "--no-reports",
            "--time-zone", "Europe/Berlin", "--fail-on", "error",
        )  # fmt: skip
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            codes = [identify(folder, *words) for _ in range(2)]
        return folder, codes, out.getvalue()

    def test_it_is_an_error_with_its_advice(self, answers):
        folder, codes, out = answers
        assert codes == [3, 3]
        assert " ERROR FV-101 1.csv FV-101: the stem stayed at " in out
        assert "\n       inspect the stem and repeat the test with more force\n" in out
        moved, seized = rows_of(folder / "friction.csv").values()
        assert (moved["level"], moved["error"]) == ("OK", "")
        assert (seized["level"], seized["ne_107"]) == ("ERROR", "F")
        assert seized["error"].startswith("the stem did not move: ")
        assert ">stuck<" in (folder / "friction.html").read_text()

    def test_it_is_filed_once_with_its_alarm(self, answers):
        folder, *_ = answers
        moved, seized = entries(folder, "FV-101")
        assert (moved.refusal, bool(seized.refusal)) == ("", True)
        assert seized.diagnosis.level.name == "ERROR"
        file = HistoryFile(folder / "history.sqlite")
        (alarm,) = read_alarms(file, kept_valve("FV-101").name).values()
        assert (alarm.kind.value, alarm.condition.level.name) == ("stuck", "ERROR")
        assert alarm.state.value == "unacknowledged"
        assert alarm.raised == seized.span.end

    def test_without_a_baseline_it_is_refused_and_no_alarm(self, answers, tmp_path):
        folder, *_ = answers
        name = "FV-101 1.csv"
        make_plant(tmp_path, {name: (folder / "exports" / name).read_text()})
        page = tmp_path / "friction.html"
        assert identify(tmp_path, "--history", tmp_path / "history.sqlite", "--output", page) == 2
        (seized,) = rows_of(tmp_path / "friction.csv").values()
        assert (seized["level"], seized["what_to_do"]) == ("", "")
        assert ">refused<" in page.read_text()
        file = HistoryFile(tmp_path / "history.sqlite")
        assert not read_alarms(file, kept_valve("FV-101").name)
