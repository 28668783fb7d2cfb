"""The sub-command `identify`, as people and programs use it."""

import dataclasses
import gzip
import json
import math
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from valve_friction_ros.commands.output.result_output import as_json, print_table
from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_refined,
    identify_signature,
    published_estimate,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    TriangleWave,
    simulate,
)

POSITION_BIAS = 1.13e-3
FOUR_COLUMNS = ["--position-bias", str(POSITION_BIAS)]
KEYS = {
    "method",
    "parameters",
    "threshold",
    "samples",
    "sigma",
    "r_squared",
    "window",
    "chosen_window",
    "fit",
    "rms",
    "systematic_misfit",
    "model_describes",
    "warnings",
}
PARAMETER_KEYS = {
    "value",
    "standard_error",
    "interval",
    "verdict",
    "reason",
    "published",
    "unit",
    "fixed",
}
SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file
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


def run(*arguments, code="from valve_friction_ros.commands.main import main"):
    """Run the command as a process of its own; without `code`, as `python -m` does."""
    module = ["-m", "valve_friction_ros"]
    how = module if code is None else ["-c", f"import sys; {code}; sys.exit(main())"]
    return subprocess.run(
        [sys.executable, *how, "identify", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def call(command):
    """Function of arguments: exit code, stdout and stderr of `identify`."""
    return partial(command, "identify")


@pytest.fixture
def printed(call):
    """Function of arguments: the one JSON object that the command prints."""

    def printed(*arguments):
        code, out, err = call(*arguments, "--json")
        assert (code, err) == (0, "")
        assert out.count("\n") == 1
        return json.loads(out, parse_constant=pytest.fail)

    return printed


def column(answer, key):
    """One entry of every parameter by name."""
    return {name: entry[key] for name, entry in answer["parameters"].items()}


def values(answer):
    return column(answer, "value")


def known(answer):
    """The values that are not withheld."""
    return {name: value for name, value in values(answer).items() if value is not None}


def none_for_nan(value):
    return None if math.isnan(value) else value


@pytest.fixture(scope="session")
def result(quick_record):
    return identify_refined(quick_record, BENCH_VALVE, SETTINGS)


class TestProcesses:
    """As typed into a shell."""

    def test_json_of_the_bench_record(self, write_csv, columns_of, square_record, bench_options):
        """What is asked of noise-free records, and the very numbers of the library."""
        path = write_csv(columns_of(square_record))
        done = run(path, *bench_options, *FOUR_COLUMNS, "--json", code=None)
        assert (done.returncode, done.stderr) == (0, "")
        answer = json.loads(done.stdout)
        published = column(answer, "published")
        for found in (published, values(answer)):
            for name in ("viscous_friction", "coulomb_friction", "spring_constant"):
                assert found[name] == pytest.approx(getattr(LOW_FRICTION, name), rel=1e-3)
        assert published["mass"] == pytest.approx(LOW_FRICTION.mass, rel=0.1)
        settings = IdentificationSettings(position_bias=POSITION_BIAS)
        expected = published_estimate(square_record, BENCH_VALVE, settings)
        assert published == expected.values
        assert answer["threshold"] == expected.threshold
        assert answer["model_describes"] is True

    def test_without_ros(self, quick_csv, bench_options, tmp_path):
        """Not even a figure needs rclpy, nor the global state of matplotlib."""
        blocked = (
            "sys.modules['rclpy'] = sys.modules['matplotlib.pyplot'] = None; "
            "from valve_friction_ros.commands.main import main"
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
        assert re.fullmatch(r"valve_friction identify: \S+record\.csv: .+\n", done.stderr)


class TestJson:
    def test_the_assessment_of_the_library(self, printed, quick_csv, result, bench_options):
        answer = printed(quick_csv, *bench_options)
        assert set(answer) == KEYS
        assert list(answer["parameters"]) == list(UNITS) == list(result.parameters)
        for name, entry in answer["parameters"].items():
            expected = result.parameters[name]
            assert entry == {
                "value": none_for_nan(expected.value),
                "standard_error": none_for_nan(expected.standard_error),
                "interval": [none_for_nan(end) for end in expected.interval],
                "verdict": expected.verdict.value,
                "reason": expected.reason,
                "published": result.estimate.values[name],
                "unit": UNITS[name],
                "fixed": False,
            }
        assert answer["fit"] == result.misfit.fit
        assert answer["rms"] == result.misfit.rms
        assert answer["systematic_misfit"] == result.misfit.systematic
        assert answer["model_describes"] is True
        assert answer["chosen_window"] == result.start.settings.published_window

    def test_the_published_estimate_beside_it(
        self, printed, quick_csv, quick_record, bench_options
    ):
        answer = printed(quick_csv, *bench_options)
        expected = published_estimate(quick_record, BENCH_VALVE, SETTINGS)
        assert column(answer, "published") == expected.values
        for key in ("threshold", "samples", "sigma", "r_squared"):
            assert answer[key] == getattr(expected, key)
        assert answer["window"] == 31
        assert expected.warnings
        notes = [f"published estimate: {warning}" for warning in expected.warnings]
        assert answer["warnings"] == notes

    def test_a_number_without_a_verdict_is_never_shown(self, printed, quick_csv, bench_options):
        """What the record does not tell is null throughout, with the reason beside it."""
        answer = printed(quick_csv, *bench_options)
        assert {name for name, value in values(answer).items() if value is None} == {
            "mass",
            "static_friction",
        }
        for entry in answer["parameters"].values():
            assert set(entry) == PARAMETER_KEYS
            numbers = [entry["value"], entry["standard_error"], *entry["interval"]]
            if entry["verdict"] == "not identifiable":
                assert numbers == [None] * 4
                assert entry["reason"]
            else:
                assert entry["verdict"] in ("identified", "weak", "fixed")
                low, high = entry["interval"]
                assert low < entry["value"] < high
        mass = answer["parameters"]["mass"]
        assert mass["reason"].endswith("; 1.6 kg assumed")
        assert mass["published"] == 1.6  # assumed there as well

    def test_without_a_published_estimate(self, result):
        """The rest of the answer does not depend on it."""
        alone = dataclasses.replace(result, published=None, warnings=("no answer",))
        answer = as_json(alone)
        assert set(answer) == KEYS
        assert set(column(answer, "published").values()) == {None}
        assert values(answer) == values(as_json(result))
        assert answer["threshold"] == result.start.threshold
        assert answer["warnings"] == ["no answer"]

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
        for name in fixed:
            entry = answer["parameters"][name]
            assert entry["verdict"] == "fixed"
            assert entry["standard_error"] == 0.0
            assert entry["interval"] == [entry["value"]] * 2
            assert entry["published"] == entry["value"]

    def test_threshold(self, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, "--fix", "limit_velocity=0.002")
        assert answer["threshold"] == 0.002

    def test_position_bias(self, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, *FOUR_COLUMNS)
        for found in (values(answer), column(answer, "published")):
            assert found["spring_preload"] == pytest.approx(
                found["spring_constant"] * POSITION_BIAS, rel=1e-12
            )

    def test_window_sets_both_and_so_does_the_order(
        self, printed, quick_csv, quick_record, bench_options
    ):
        answer = printed(quick_csv, *bench_options, "--window", 15, "--order", 4)
        settings = IdentificationSettings(derivative_window=15, order=4, assumed_mass=1.6)
        assert (answer["window"], answer["chosen_window"]) == (15, 15)
        expected = identify_refined(quick_record, BENCH_VALVE, settings, 15)
        assert expected.start.settings.order == 4
        assert column(answer, "published") == expected.estimate.values
        assert known(answer) == {
            name: value for name, value in expected.values.items() if not math.isnan(value)
        }

    def test_without_it_the_record_chooses_one(self, printed, quick_csv, bench_options):
        """No noise, no need of 31 samples; the published estimate keeps its 31."""
        answer = printed(quick_csv, *bench_options)
        assert answer["window"] == 31
        assert 5 <= answer["chosen_window"] < 31

    def test_valve(self, printed, quick_csv, bench_options, tmp_path):
        """Twice the area is twice the force, and so is every parameter; 2 rounds nothing."""
        path = tmp_path / "valve.yaml"
        path.write_text("diaphragm_area: 0.089\npressure_reference: 41740.0\n")
        once = printed(quick_csv, *bench_options, "--fix", "mass=1.6")
        twice = printed(quick_csv, "--valve", path, "--fix", "mass=3.2")
        doubled = {name: 2 * value for name, value in column(once, "published").items()}
        assert column(twice, "published") == doubled
        assert known(twice) == pytest.approx(
            {name: 2 * value for name, value in known(once).items()}, rel=1e-6
        )

    @pytest.mark.parametrize("header", ["force_n", "F [N]"])
    def test_force(
        self, printed, write_csv, columns_of, quick_record, quick_csv, bench_options, header
    ):
        """The actuator's force in the file, and no valve file: the same sums, the same result."""
        columns = columns_of(quick_record)
        pressure = columns.pop("pressure_pa")
        path = write_csv(columns | {header: BENCH_VALVE.actuator_force(pressure)}, "force.csv")
        found = printed(path, "--force-column", header, "--fix", "mass=1.6")
        expected = printed(quick_csv, *bench_options, "--fix", "mass=1.6")
        assert column(found, "published") == column(expected, "published")
        assert column(found, "verdict") == column(expected, "verdict")
        assert known(found) == pytest.approx(known(expected), rel=1e-9)
        refined = ("parameters", "fit", "rms", "systematic_misfit")
        assert {key: found[key] for key in found if key not in refined} == {
            key: expected[key] for key in expected if key not in refined
        }

    def test_help_names_all(self, call, capsys):
        with pytest.raises(SystemExit) as ended:
            call("--help")
        assert ended.value.code == 0
        options = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
        columns = {f"--{name}-column" for name in ("time", "position", "pressure", "force")}
        others = {"--valve", "--fix", "--position-bias", "--window", "--order", "--plot", "--json"}
        assert options >= columns | others


def row_of(out, name):
    """The row of a parameter in the printed table, without doubled spaces."""
    (row,) = (line for line in out.split("\n\n")[0].splitlines() if line.split()[0] == name)
    return " ".join(row.split())


class TestTable:
    def test_every_parameter_with_interval_and_verdict(
        self, call, result, quick_csv, bench_options
    ):
        code, out, err = call(quick_csv, *bench_options)
        assert (code, err) == (0, "")
        weak = "weak"  # two strokes only
        for name, unit in UNITS.items():
            one = result.parameters[name]
            published = format(result.estimate.values[name], ".6g")
            if math.isnan(one.value):
                assert row_of(out, name) == f"{name} – {unit} not identifiable {published}"
            else:
                size = one.half_width
                digits = f"{size:.0f}" if size >= 100 else f"{size:.2g}"
                assert row_of(out, name) == f"{name} {one.value:.6g} {digits} {unit} {weak} " + (
                    published
                )
        assert "nan" not in out

    def test_fixed_values_have_no_width(self, call, quick_csv, bench_options):
        options = ["--fix", "spring_constant=2.05e5", "--fix", "mass"]
        _, out, _ = call(quick_csv, *bench_options, *options)
        assert row_of(out, "spring_constant") == "spring_constant 205000 N/m fixed 205000"
        assert row_of(out, "mass") == "mass 1.6 kg fixed 1.6"
        assert "fixed: given" not in out

    def test_reasons_fit_and_notes(self, call, printed, result, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options)
        words = " ".join(call(quick_csv, *bench_options)[1].split())
        for name, entry in answer["parameters"].items():
            assert f"{name} {entry['verdict']}: {entry['reason']}" in words
        misfit = result.misfit
        share = f"{100 * misfit.rms / BENCH_VALVE.travel:.2g} % of travel"
        assert f"fit {100 * misfit.fit:.2f} %: the refined model's stem is" in words
        assert f"{misfit.rms * 1e6:.3g} µm rms from the measured one, {share}; " in words
        assert f"; {misfit.systematic * 1e6:.3g} µm of it are not noise" in words
        assert f"threshold δv {answer['threshold']:.4g} m/s, {answer['samples']} samples" in words
        assert f"window 31 samples; refined from {answer['chosen_window']}" in words
        assert answer["warnings"]
        for warning in answer["warnings"]:
            assert f"note: {warning}" in words

    def test_doubt_of_the_model_is_a_note(self, result, capsys):
        """And what was not identified leaves a dash, the published value beside it or not."""
        doubt = "the Karnopp model does not describe this valve: 98 µm [of it] are not noise"
        friction = Parameter(
            "coulomb_friction", math.nan, math.nan, math.nan, Verdict.NOT_IDENTIFIABLE, doubt
        )
        doubted = dataclasses.replace(
            result,
            warnings=(doubt,),
            published=None,
            parameters={**result.parameters, "coulomb_friction": friction},
        )
        print_table(doubted, BENCH_VALVE)
        out = capsys.readouterr().out
        assert row_of(out, "coulomb_friction") == "coulomb_friction – N not identifiable"
        words = " ".join(out.split())
        assert f"coulomb_friction not identifiable: {doubt}" in words
        assert f"note: {doubt}" in words
        assert "nan" not in out


SLIPPING = dataclasses.replace(GRAPHITE_PACKING, mass=1.6)
FALLING = dataclasses.replace(SLIPPING, stribeck_velocity=3.26e-3)
"""A published identification of a graphite packing."""


class TestSlipJumps:
    """Graphite packing: sixteen seconds of a sine at 100 Hz, 10 µm and 100 Pa of noise."""

    NAMES = ("coulomb_friction", "static_friction", "viscous_friction", "spring_constant")

    @pytest.fixture
    def options(self, tmp_path):
        path = tmp_path / "graphite.yaml"
        geometry = dataclasses.asdict(GRAPHITE_VALVE)
        path.write_text("\n".join(f"{name}: {value}" for name, value in geometry.items()))
        return ["--valve", path, "--fix", "mass=1.6"]

    @pytest.fixture
    def file_of(self, write_csv, columns_of):
        """Function of a packing and a delay of the stem's stamps (samples): its record."""

        def build(packing, delay=0):
            pressure = SineWave(period=4.0).sample(np.arange(1600) / 100)
            position = simulate(GRAPHITE_VALVE, packing, pressure, 0.01).position
            record = SensorNoise(10e-6, 100.0, seed=1).applied_to(
                Recording(0.01, pressure[delay:], position[: 1600 - delay])
            )
            return write_csv(columns_of(record))

        return build

    def assert_true(self, answer, packing):
        """The bounds of the whole benchmark: 5 %, and no error beyond three half widths."""
        for name in self.NAMES:
            entry, truth = answer["parameters"][name], getattr(packing, name)
            assert entry["verdict"] == "identified", name
            assert entry["value"] == pytest.approx(truth, rel=0.05)
            low, high = entry["interval"]
            assert abs(entry["value"] - truth) < 1.5 * (high - low)
        assert answer["model_describes"] is True
        assert answer["systematic_misfit"] < 10e-6

    def test_a_slip_jump_tells_the_static_friction(self, printed, file_of, options):
        answer = printed(file_of(SLIPPING), *options)
        self.assert_true(answer, SLIPPING)
        assert list(answer["parameters"]) == list(UNITS)

    def test_a_fall_of_the_friction_is_told_with_its_speed(self, printed, file_of, options):
        answer = printed(file_of(FALLING), *options)
        self.assert_true(answer, FALLING)
        assert list(answer["parameters"]) == [*UNITS, "stribeck_velocity"]
        entry = answer["parameters"]["stribeck_velocity"]
        assert set(entry) == PARAMETER_KEYS
        assert (entry["unit"], entry["published"]) == ("m/s", None)
        low, high = entry["interval"]
        assert low < FALLING.stribeck_velocity < high

    def test_the_fall_in_the_table(self, call, file_of, options):
        """Between 2.9 and 3.6 mm/s, with its interval, and nothing published to compare with."""
        code, out, err = call(file_of(FALLING), *options)
        assert (code, err) == (0, "")
        row = row_of(out, "stribeck_velocity")
        assert re.fullmatch(
            r"stribeck_velocity 0\.00(29|3[0-6])\d+ \S+ m/s (identified|weak)", row
        ), row

    def test_late_stamps_are_reported(self, call, printed, file_of, options):
        """Ten samples, 100 ms: to a tenth of a period, in the note as in the parameters."""
        path = file_of(SLIPPING, delay=10)
        entry = printed(path, *options)["parameters"]["clock_offset"]
        assert entry["value"] == pytest.approx(0.1, abs=1e-3)
        assert entry["unit"] == "s"
        words = " ".join(call(path, *options)[1].split())
        assert re.search(
            r"note: the stamps of the stem are (99|100|101)(\.\d)? ms late against those", words
        )


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
        assert err.startswith(f"valve_friction identify: {tmp_path / name}: {message}")
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
        assert command == "valve_friction identify"
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
                "row 52, column 'pressure_pa': 250000 Pa is outside the sensor's range 0 to 250000",
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


def glide(record, share):
    """Positions of `record` at the lower stop but for a share of it."""
    above = record.position - record.position.min()
    return np.where(np.arange(len(record)) < share * len(record), above, 0.0)


class TestRecordsThatCannotTell:
    """Whole records that are refused, with what to do about it."""

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (
                lambda r: {"position_m": 1e3 * r.position},
                "the stem position runs from 3.691 to 23.89 m, the travel from 0 to 0.02857 m: "
                "check for swapped signals, the unit (m)",
            ),
            (
                lambda r: {"position_m": 0.01 + 0.01 * r.position},
                "too little travel: the stem moved 0.202 mm, 0.71 % of its travel; excite",
            ),
            (
                lambda r: {"position_m": glide(r, 0.4)},
                "the stem lies at its lower stop for ",
            ),
            (
                lambda r: {"position_m": BENCH_VALVE.travel - glide(r, 0.4)},
                "the stem lies at its upper stop for ",
            ),
            (
                lambda r: {"position_m": 0.028 - r.position},
                "the stem moves against the pressure: count the position in the direction",
            ),
            (
                lambda r: {"pressure_pa": np.roll(r.pressure, len(r) // 4)},
                "no friction model reproduces the record (fit ",
            ),
            (
                lambda r: {"pressure_pa": np.full(len(r), 1e5)},
                "the pressure did not change: excite the valve, or check its sensor",
            ),
        ],
        ids=[
            "millimetres",
            "little travel",
            "lower stop",
            "upper stop",
            "against",
            "a quarter period apart",
            "dead",
        ],
    )
    @pytest.mark.parametrize("how", ["table", "json"])
    def test_refused(
        self, refusal, write_csv, columns_of, quick_record, bench_options, change, message, how
    ):
        path = write_csv(columns_of(quick_record) | change(quick_record))
        options = ["--json"] if how == "json" else []
        assert refusal(path, *bench_options, *options).startswith(f"{path}: {message}")

    def test_sampled_too_slowly(self, refusal, write_csv, columns_of, benches, bench_options):
        """Ten samples a second of a stem that crosses its range within one of them."""
        pressure = np.where(np.arange(400) // 20 % 2, 160e3, 64e3)
        position = simulate(*benches["low"], pressure, 0.1).position
        path = write_csv(columns_of(Recording(0.1, pressure, position)))
        message = refusal(path, *bench_options)
        assert message.startswith(f"{path}: sampling is too slow for the motion: the stem moves ")
        assert "0.1 s apart; sample faster" in message

    def test_no_picture_is_left(self, refusal, write_csv, columns_of, quick_record, bench_options):
        path = write_csv(columns_of(quick_record) | {"position_m": 0.028 - quick_record.position})
        refusal(path, *bench_options, "--plot", path.with_suffix(".png"))
        assert not path.with_suffix(".png").exists()


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
            (["--fix", "mass=1", "--fix", " mass =2"], "--fix mass is given twice"),
            (["--fix", "mass", "--fix", "mass"], "--fix mass is given twice"),
            (["--fix", "mass=-1"], "mass must be above zero, got -1"),
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
            entry = answer["parameters"][name]
            assert entry["published"] == pytest.approx(value, rel=0.05), name
            low, high = entry["interval"]
            assert entry["value"] == pytest.approx(value, rel=0.02) or low < value < high, name
            assert entry["verdict"] in ("identified", "weak")
        assert values(answer)["spring_constant"] == 0.0
        assert {answer[key] for key in ("rms", "systematic_misfit", "model_describes")} == {None}
        assert 0.9 < answer["fit"] < 1.0
        assert answer["parameters"]["spring_constant"]["fixed"] is True
        assert answer["window"] == 31

    def test_by_its_own_headers(self, printed, recorded):
        names = EMPS.read_text().split("\n", 1)[0].split(",")
        options = ["--time-column", names[0], "--force-column", names[1]]
        options += ["--position-column", names[2], "--fix", "spring_constant=0"]
        assert printed(EMPS, *options) == printed(recorded, "--fix", "spring_constant=0")


class TestForceBalance:
    """A signature by ``--method force_balance``, as the library identifies it."""

    @pytest.fixture(scope="class")
    def signature(self, benches):
        pressure = TriangleWave().sample(np.arange(13_000) / 100)
        position = simulate(*benches["high"], pressure, 0.01).position
        return Recording(0.01, pressure, position)

    @pytest.fixture
    def path(self, write_csv, columns_of, signature):
        return write_csv(columns_of(signature))

    @pytest.fixture(scope="class")
    def expected(self, signature):
        return identify_signature(signature, BENCH_VALVE, SETTINGS)

    def test_json(self, printed, path, bench_options, expected):
        answer = printed(path, *bench_options, "--method", "signature")
        assert answer["method"] == "signature"
        assert values(answer) == pytest.approx(
            {name: none_for_nan(value) for name, value in expected.values.items()}, rel=1e-9
        )
        signature = expected.signature
        assert answer["position_bias"] == pytest.approx(signature.position_bias, rel=1e-6)
        assert answer["dead_zone"] == pytest.approx(signature.dead_zone, rel=1e-9)
        points = [(one["direction"], one["time"]) for one in answer["breakaway_points"]]
        assert [way for way, _ in points] == [1, -1, 1, -1, 1]
        assert {entry["published"] for entry in answer["parameters"].values()} == {None}
        assert answer["fit"] == pytest.approx(expected.fit, rel=1e-6)

    def test_table_and_picture(self, call, path, bench_options, tmp_path):
        picture = tmp_path / "signature.png"
        code, out, err = call(path, *bench_options, "--method", "signature", "--plot", picture)
        assert (code, err) == (0, "")
        words = " ".join(out.split())
        assert "the model's stem is" in words
        assert "signature: 3 strokes up and 2 down, bias x̄ 1.1" in words
        assert picture.read_bytes().startswith(PNG)

    def test_a_square_wave_is_refused(
        self, call, write_csv, columns_of, square_record, bench_options
    ):
        path = write_csv(columns_of(square_record))
        code, out, err = call(path, *bench_options, "--method", "signature")
        assert (code, out) == (2, "")
        assert err.startswith(
            f"valve_friction identify: {path}: the stem does not slide at a constant"
        )
        assert "slow triangular wave" in err
        assert err.count("\n") == 1
