"""The command `identify_recording`, as people and programs use it."""

import gzip
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from valve_friction_ros.commands.identify_recording import main
from valve_friction_ros.identification import UNITS, IdentificationSettings, identify
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION

POSITION_BIAS = 1.13e-3
FOUR_COLUMNS = ["--position-bias", str(POSITION_BIAS)]
KEYS = {"parameters", "threshold", "samples", "sigma", "r_squared", "window", "warnings"}
EMPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "emps" / "emps_identification.csv"
PUBLISHED = {  # IDIM-LS
    "mass": 95.1089,
    "viscous_friction": 203.5034,
    "coulomb_friction": 20.3935,
    "spring_preload": -3.1648,
}
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="session")
def bench_options(bench_yaml):
    return ["--valve", str(bench_yaml)]


@pytest.fixture
def quick_csv(write_csv, columns_of, quick_record):
    return write_csv(columns_of(quick_record))


def run(*arguments, code="from valve_friction_ros.commands.identify_recording import main"):
    """Run the command as a process of its own; without `code`, as `python -m` does."""
    module = ["-m", "valve_friction_ros.commands.identify_recording"]
    how = module if code is None else ["-c", f"import sys; {code}; sys.exit(main())"]
    return subprocess.run(
        [sys.executable, *how, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def call(capsys):
    """Function of arguments: exit code, stdout and stderr of the command in this process."""

    def call(*arguments):
        code = main([str(argument) for argument in arguments])
        return (code, *capsys.readouterr())

    return call


@pytest.fixture
def printed(call):
    """Function of arguments: the one JSON object that the command prints."""

    def printed(*arguments):
        code, out, err = call(*arguments, "--json")
        assert (code, err) == (0, "")
        assert out.count("\n") == 1
        return json.loads(out, parse_constant=pytest.fail)

    return printed


def values(answer):
    return {name: entry["value"] for name, entry in answer["parameters"].items()}


class TestProcesses:
    """As typed into a shell."""

    def test_json_of_the_bench_record(self, write_csv, columns_of, square_record, bench_options):
        """What is asked of noise-free records, and the very numbers of the library."""
        path = write_csv(columns_of(square_record))
        done = run(path, *bench_options, *FOUR_COLUMNS, "--json", code=None)
        assert (done.returncode, done.stderr) == (0, "")
        answer = json.loads(done.stdout)
        found = values(answer)
        for name in ("viscous_friction", "coulomb_friction", "spring_constant"):
            assert found[name] == pytest.approx(getattr(LOW_FRICTION, name), rel=1e-3)
        assert found["mass"] == pytest.approx(LOW_FRICTION.mass, rel=0.1)
        settings = IdentificationSettings(position_bias=POSITION_BIAS)
        expected = identify(square_record, BENCH_VALVE, settings)
        assert found == expected.values
        assert answer["threshold"] == expected.threshold

    def test_without_ros(self, quick_csv, bench_options, tmp_path):
        """Not even a figure needs rclpy, nor the global state of matplotlib."""
        blocked = (
            "sys.modules['rclpy'] = sys.modules['matplotlib.pyplot'] = None; "
            "from valve_friction_ros.commands.identify_recording import main"
        )
        picture = tmp_path / "record.png"
        done = run(quick_csv, *bench_options, "--plot", picture, code=blocked)
        assert (done.returncode, done.stderr) == (0, "")
        assert "coulomb_friction" in done.stdout
        assert picture.read_bytes().startswith(PNG)

    def test_one_line_for_a_bad_file(self, tmp_path, bench_options):
        """Not even a warning of a library stands beside it."""
        path = tmp_path / "record.csv"
        path.write_text("time_s,position_m,pressure_pa\n")
        done = run(path, *bench_options)
        assert (done.returncode, done.stdout) == (2, "")
        assert re.fullmatch(r"identify_recording: \S+record\.csv: .+\n", done.stderr)


class TestJson:
    def test_the_estimate_of_the_library(self, printed, quick_csv, quick_record, bench_options):
        answer = printed(quick_csv, *bench_options)
        expected = identify(quick_record, BENCH_VALVE, IdentificationSettings(assumed_mass=1.6))
        assert set(answer) >= KEYS
        assert values(answer) == expected.values
        assert list(answer["parameters"]) == list(UNITS)
        for name, entry in answer["parameters"].items():
            assert entry["unit"] == UNITS[name]
            assert entry["fixed"] == (name in expected.fixed)
        for key in ("threshold", "samples", "sigma", "r_squared"):
            assert answer[key] == getattr(expected, key)
        assert answer["window"] == 31
        assert answer["warnings"] == list(expected.warnings)
        assert answer["parameters"]["mass"] == {"value": 1.6, "unit": "kg", "fixed": True}

    def test_gzipped(self, printed, quick_csv, bench_options):
        packed = quick_csv.with_name("record.csv.gz")
        packed.write_bytes(gzip.compress(quick_csv.read_bytes()))
        assert printed(packed, *bench_options) == printed(quick_csv, *bench_options)

    def test_other_headers(self, printed, quick_csv, write_csv, quick_record, bench_options):
        path = write_csv(
            {
                "note": np.full(len(quick_record), math.nan),
                "p": quick_record.pressure,
                "x": quick_record.position,
                "t": np.round(quick_record.time, 9),
            },
            "other.csv",
        )
        names = ["--time-column", "t", "--position-column", "x", "--pressure-column", "p"]
        assert printed(path, *bench_options, *names) == printed(quick_csv, *bench_options)


class TestOptions:
    def test_fixed_by_value_and_by_name(self, printed, quick_csv, bench_options):
        answer = printed(
            quick_csv, *bench_options, "--fix", "spring_constant=2.05e5", "--fix", "mass"
        )
        fixed = {name for name, entry in answer["parameters"].items() if entry["fixed"]}
        assert fixed == {"spring_constant", "mass"}
        assert values(answer)["spring_constant"] == 2.05e5
        assert values(answer)["mass"] == 1.6  # of the valve file
        assert answer["warnings"] == []

    def test_threshold(self, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, "--fix", "limit_velocity=0.002")
        assert answer["threshold"] == 0.002

    def test_position_bias(self, printed, quick_csv, bench_options):
        found = values(printed(quick_csv, *bench_options, *FOUR_COLUMNS))
        assert found["spring_preload"] == found["spring_constant"] * POSITION_BIAS

    def test_window_and_order(self, printed, quick_csv, quick_record, bench_options):
        answer = printed(quick_csv, *bench_options, "--window", 15, "--order", 4)
        settings = IdentificationSettings(window=15, order=4, assumed_mass=1.6)
        assert answer["window"] == 15
        assert values(answer) == identify(quick_record, BENCH_VALVE, settings).values

    def test_valve(self, printed, quick_csv, bench_options, tmp_path):
        """Twice the area is twice the force, and so is every parameter; 2 rounds nothing."""
        path = tmp_path / "valve.yaml"
        path.write_text("diaphragm_area: 0.089\npressure_reference: 41740.0\n")
        once = values(printed(quick_csv, *bench_options, "--fix", "mass=0"))
        twice = values(printed(quick_csv, "--valve", path, "--fix", "mass=0"))
        assert twice == {name: 2 * value for name, value in once.items()}

    @pytest.mark.parametrize("header", ["force_n", "F [N]"])
    def test_force(
        self, printed, write_csv, columns_of, quick_record, quick_csv, bench_options, header
    ):
        """The actuator's force in the file, and no valve file: the same sums, the same result."""
        columns = columns_of(quick_record)
        pressure = columns.pop("pressure_pa")
        path = write_csv(columns | {header: BENCH_VALVE.actuator_force(pressure)}, "force.csv")
        found = printed(path, "--force-column", header, "--fix", "mass=1.6")
        assert found == printed(quick_csv, *bench_options, "--fix", "mass=1.6")

    def test_help_names_all(self, capsys):
        with pytest.raises(SystemExit) as ended:
            main(["--help"])
        assert ended.value.code == 0
        options = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
        columns = {f"--{name}-column" for name in ("time", "position", "pressure", "force")}
        others = {"--valve", "--fix", "--position-bias", "--window", "--order", "--plot", "--json"}
        assert options >= columns | others


class TestTable:
    def test_every_parameter_with_its_unit(self, call, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options)
        code, out, err = call(quick_csv, *bench_options)
        assert (code, err) == (0, "")
        for name, entry in answer["parameters"].items():
            note = " +fixed" if entry["fixed"] else ""
            line = (
                rf"^ *{name} +{re.escape(format(entry['value'], '.6g'))} +{entry['unit']}{note} *$"
            )
            assert re.search(line, out, re.MULTILINE), (line, out)
        words = " ".join(out.split())
        assert f"threshold δv {answer['threshold']:.4g} m/s, {answer['samples']} samples" in words
        assert "window 31 samples" in words
        (warning,) = answer["warnings"]
        assert f"note: {warning}" in words


class TestPlot:
    def test_a_picture_and_the_numbers(self, call, quick_csv, bench_options, tmp_path):
        picture = tmp_path / "record.png"
        code, out, err = call(quick_csv, *bench_options, "--plot", picture, "--json")
        assert (code, err) == (0, "")
        assert set(json.loads(out)) >= KEYS
        assert picture.read_bytes().startswith(PNG)
        pixels = matplotlib.image.imread(picture)
        assert min(pixels.shape[:2]) > 500
        assert np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0).shape[0] > 10  # colours

    def test_of_a_single_threshold(self, call, quick_csv, bench_options, tmp_path):
        picture = tmp_path / "record.svg"
        options = ["--fix", "limit_velocity=0.002", "--plot", picture]
        assert call(quick_csv, *bench_options, *options)[0] == 0
        assert "<svg" in picture.read_text()

    @pytest.mark.parametrize(
        ("name", "message"),
        [
            ("record.xyz", "not a picture format; choose from ."),
            ("no/record.png", "there is no folder"),
        ],
    )
    def test_a_place_it_cannot_go_to(self, call, quick_csv, bench_options, tmp_path, name, message):
        code, out, err = call(quick_csv, *bench_options, "--plot", tmp_path / name)
        assert (code, out) == (2, "")
        assert err.startswith(f"identify_recording: {tmp_path / name}: {message}")
        assert err.count("\n") == 1


@pytest.fixture
def refusal(call):
    """Function of arguments: the one line on stderr that goes with exit code 2."""

    def refusal(*arguments):
        code, out, err = call(*arguments)
        assert (code, out) == (2, "")
        line, rest = err.split("\n", 1)
        assert rest == ""
        command, _, message = line.partition(": ")
        assert command == "identify_recording"
        return message

    return refusal


class TestBadRecords:
    """What the file holds is no record, or no record of a moving valve."""

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (lambda c: c.update({name: [] for name in c}), "there are no rows under the header"),
            (
                lambda c: c.update({k: v[:309] for k, v in c.items()}),
                "the record is too short: 309 s",
            ),
            (
                lambda c: c["position_m"].fill(0.01),
                "the stem did not move: its position spans 0 µm",
            ),
            (lambda c: c["position_m"].sort(), "the stem moved up only"),
            (
                lambda c: c["position_m"].put(50, math.nan),
                "row 52, column 'position_m': nan is not",
            ),
            (
                lambda c: c["pressure_pa"].put(50, math.inf),
                "row 52, column 'pressure_pa': inf is not",
            ),
            (lambda c: c["time_s"].put(50, -math.inf), "row 52, column 'time_s': -inf is not"),
            (
                lambda c: c["time_s"].put(50, 0.49),
                "row 52, column 'time_s' repeats (0.49 after 0.49)",
            ),
            (
                lambda c: c["time_s"].put(50, 0.48),
                "row 52, column 'time_s' goes back (0.48 after 0",
            ),
            (
                lambda c: c["time_s"].__iadd__(0.2 * (np.arange(1000) >= 50)),
                "row 52, column 'time_s': gap of 0.21 s",
            ),
            (
                lambda c: c["pressure_pa"].put(50, 250000.5),
                "row 52, column 'pressure_pa': 250000 is outside the sensor's range 0 to 250000 Pa",
            ),
            (lambda c: c.pop("time_s"), "no column 'time_s' among position_m, pressure_pa"),
            (lambda c: c.pop("pressure_pa"), "no column 'pressure_pa' (or 'force_n') among time_s"),
        ],
        ids=[
            "empty",
            "short",
            "never moved",
            "one way",
            "nan",
            "inf",
            "time inf",
            "repeated",
            "backward",
            "gap",
            "range",
            "no time",
            "no pressure",
        ],
    )
    def test_refused(
        self, refusal, write_csv, columns_of, quick_record, bench_options, change, message
    ):
        columns = {name: np.array(column) for name, column in columns_of(quick_record).items()}
        change(columns)
        path = write_csv(columns)
        assert refusal(path, *bench_options).startswith(f"{path}: {message}")

    def test_text_in_a_number(self, refusal, quick_csv, bench_options):
        lines = quick_csv.read_text().splitlines()
        lines[51] = "0.5,open,1e5"
        quick_csv.write_text("\n".join(lines))
        assert refusal(quick_csv, *bench_options).startswith(
            f"{quick_csv}: row 52, column 'position_m': 'open' is not a number"
        )

    def test_no_file(self, refusal, tmp_path, bench_options):
        path = tmp_path / "none.csv"
        expected = f"{path}: cannot be read as CSV: No such file or directory"
        assert refusal(path, *bench_options) == expected

    def test_a_record_that_is_too_short_for_the_window(self, refusal, quick_csv, bench_options):
        message = refusal(quick_csv, *bench_options, "--window", 101)
        assert message.startswith(f"{quick_csv}: the record is too short: 1000 samples")


class TestBadOptions:
    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("travel: 0.03", "diaphragm_area is missing"),
            ("diaphragm_area: -1.0", "diaphragm_area must be above zero, got -1"),
            ("diaphragm_area: wide", "diaphragm_area must be a number, got 'wide'"),
            ("diaphragm_area: 1.0\nmass: -1.0", "mass must be above zero, got -1"),
            ("diaphragm_area: 1.0\npressure_minimum: low", "pressure_minimum must be a number"),
            (
                "diaphragm_area: 1.0\nstatic_friction: 5.0\ncoulomb_friction: 6.0",
                "static_friction (5) must not be below coulomb_friction (6)",
            ),
            ("diaphragm_area: 1.0\nmas: 1.0", "unknown key 'mas'; did you mean 'mass'?"),
            ("diaphragm_area: [", "not YAML: while parsing"),
        ],
    )
    def test_valve_file(self, refusal, quick_csv, tmp_path, text, message):
        path = tmp_path / "valve.yaml"
        path.write_text(text)
        assert refusal(quick_csv, "--valve", path).startswith(f"{path}: {message}")

    def test_no_valve_file_for_a_pressure(self, refusal, quick_csv):
        assert refusal(quick_csv) == (
            "pressure needs the diaphragm_area: give a valve file by --valve"
        )

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            (["--fix", "mass=heavy"], "--fix mass=heavy: 'heavy' is not a number"),
            (
                ["--fix", "spring_constant"],
                "--fix spring_constant: give a value, as spring_constant=",
            ),
            (
                ["--fix", "weight=1"],
                "'weight' is not a parameter that can be fixed; choose from mass",
            ),
            (["--fix", "mass=-1"], "mass must not be negative, got -1"),
            (["--fix", "mass=nan"], "mass must be finite, got nan"),
            (["--window", "30"], "window must be odd and at least order + 2 = 5, got 30"),
            (["--window", "3"], "window must be odd and at least order + 2 = 5, got 3"),
            (["--order", "1"], "order must be at least 2 for an acceleration, got 1"),
            (["--position-bias", "nan"], "position_bias must be finite, got nan"),
            (
                ["--position-bias", "0.001", "--fix", "spring_preload=1"],
                "position_bias and a fixed spring_preload exclude each other",
            ),
        ],
    )
    def test_refused(self, refusal, quick_csv, bench_options, options, message):
        assert refusal(quick_csv, *bench_options, *options).startswith(message)


@pytest.mark.skipif(
    not EMPS.is_file(), reason="the benchmark record is not the project's to distribute"
)
class TestRealMachine:
    @pytest.fixture
    def recorded(self, tmp_path):
        """The published record under the headers that the command expects, gzipped."""
        rows = EMPS.read_text().splitlines()[1:]
        path = tmp_path / "emps.csv.gz"
        with gzip.open(path, "wt") as stream:
            stream.write("\n".join(["time_s,force_n,position_m", *rows]) + "\n")
        return path

    def test_published_values(self, printed, recorded):
        answer = printed(recorded, "--fix", "spring_constant=0")
        for name, value in PUBLISHED.items():
            assert values(answer)[name] == pytest.approx(value, rel=0.05), name
        assert values(answer)["spring_constant"] == 0.0
        assert answer["parameters"]["spring_constant"]["fixed"] is True
        assert answer["window"] == 31

    def test_by_its_own_headers(self, printed, recorded):
        names = EMPS.read_text().split("\n", 1)[0].split(",")
        options = ["--time-column", names[0], "--force-column", names[1]]
        options += ["--position-column", names[2], "--fix", "spring_constant=0"]
        assert printed(EMPS, *options) == printed(recorded, "--fix", "spring_constant=0")
