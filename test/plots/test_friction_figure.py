"""The figure of an identification: what is drawn, and in which units."""

import dataclasses
import math

import matplotlib.image
import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings, identify
from valve_friction_ros.model import BENCH_VALVE, Recording, SquareWave, Valve
from valve_friction_ros.plots import (
    FORCE,
    Case,
    friction_figure,
    identification_figure,
    require_picture_file,
)
from valve_friction_ros.plots.panels import COLOURS

SETTINGS = IdentificationSettings(position_bias=1.13e-3)
LABELS = {"pressure", "stem", "coulomb", "sigma", "signature"}


@pytest.fixture(scope="module")
def record(bench_record):
    return bench_record("low", SquareWave(), 20.8)


@pytest.fixture(scope="module")
def estimate(record):
    return identify(record, BENCH_VALVE, SETTINGS)


@pytest.fixture(scope="module")
def figure(record, estimate):
    return identification_figure(record, BENCH_VALVE, estimate)


def panels(figure):
    """The axes of a figure by name."""
    return {axes.get_label(): axes for axes in figure.axes}


def points(line):
    return np.array(line.get_data())


class TestPanels:
    def test_every_axis_has_a_unit(self, figure):
        """Axes that stand over one another share the lower one's label."""
        found = panels(figure)
        assert set(found) == LABELS
        labels = {name: (axes.get_xlabel(), axes.get_ylabel()) for name, axes in found.items()}
        assert labels == {
            "pressure": ("", "pressure [kPa]"),
            "stem": ("time [s]", "stem [mm]"),
            "coulomb": ("", "coulomb friction $F_c$ [N]"),
            "sigma": ("threshold δv [m/s]", "$\\sigma_s$ [N]"),
            "signature": ("pressure [kPa]", "stem [mm]"),
        }
        for upper, lower in (("pressure", "stem"), ("coulomb", "sigma")):
            assert found[upper].get_shared_x_axes().joined(found[upper], found[lower])

    def test_the_record_is_drawn_in_these_units(self, figure, record):
        found = panels(figure)
        (pressure,), (stem,) = found["pressure"].lines, found["stem"].lines
        (signature,) = found["signature"].lines
        kilopascals, millimetres = record.pressure / 1e3, record.position * 1e3
        np.testing.assert_array_equal(points(pressure), [record.time, kilopascals])
        np.testing.assert_array_equal(points(stem), [record.time, millimetres])
        np.testing.assert_array_equal(points(signature), [kilopascals, millimetres])

    def test_the_sweep_with_the_chosen_threshold(self, figure, estimate):
        sweep, marker = panels(figure)["coulomb"].lines
        expected = [estimate.sweep.thresholds, estimate.sweep.estimates["coulomb_friction"]]
        np.testing.assert_array_equal(points(sweep), expected)
        chosen = [[estimate.threshold], [estimate.coulomb_friction]]
        np.testing.assert_array_equal(points(marker), chosen)
        sigma, upright = panels(figure)["sigma"].lines
        np.testing.assert_array_equal(points(sigma)[0], estimate.sweep.thresholds)
        assert set(upright.get_xdata()) == {estimate.threshold}
        (note,) = panels(figure)["coulomb"].texts
        assert note.get_text() == f"$F_c$ = {estimate.coulomb_friction:.1f} N"

    def test_the_chosen_friction_is_in_sight(self, figure, estimate):
        low, high = panels(figure)["coulomb"].get_ylim()
        assert low < estimate.coulomb_friction < high

    def test_force_of_a_machine_without_diaphragm(self, record, estimate):
        found = panels(identification_figure(record, BENCH_VALVE, estimate, FORCE))
        assert found["pressure"].get_ylabel() == "drive force [N]"
        assert found["signature"].get_xlabel() == "drive force [N]"
        np.testing.assert_array_equal(found["pressure"].lines[0].get_ydata(), record.pressure)

    def test_long_records_are_thinned(self, record, estimate):
        """Not below 20000 points, and to their whole length."""
        many = Recording(1e-3, np.tile(record.pressure, 3), np.tile(record.position, 3))
        (line,) = panels(identification_figure(many, BENCH_VALVE, estimate))["stem"].lines
        assert 20_000 <= line.get_xdata().size < 40_000
        step = line.get_xdata()[1] - line.get_xdata()[0]
        assert line.get_xdata()[-1] > many.duration - step


class TestVerdict:
    def test_of_a_valve(self, figure, estimate):
        """2·152.7 N over 2.05e5 N/m and 28.575 mm is 5.2 %."""
        assert " ".join(figure.get_suptitle().split()) == (
            f"F_c 152.7 N, F_v {estimate.viscous_friction:.4g} N·s/m, k 2.05e+05 N/m, "
            "dead band 5.2 % of travel"
        )

    def test_beyond_the_travel(self, record, estimate):
        tight = dataclasses.replace(estimate, coulomb_friction=4e3, static_friction=4e3)
        title = identification_figure(record, BENCH_VALVE, tight).get_suptitle()
        assert title.endswith("dead band 137 % of travel")

    def test_without_a_travel(self, record, estimate):
        endless = Valve(BENCH_VALVE.diaphragm_area, BENCH_VALVE.pressure_reference)
        assert "dead band" not in identification_figure(record, endless, estimate).get_suptitle()


class TestSeveralCases:
    def case(self, record, estimate, number):
        later = Recording(1e-3, record.pressure, record.position, 100.0 + 30.0 * number)
        return Case.of(f"case {number}", later, estimate)

    @pytest.mark.parametrize("count", [2, len(COLOURS)])
    def test_each_has_its_line_colour_and_name(self, record, estimate, count):
        cases = [self.case(record, estimate, number) for number in range(count)]
        found = panels(friction_figure(cases, "verdict"))
        for name in ("pressure", "stem", "signature"):
            assert [line.get_color() for line in found[name].lines] == list(COLOURS[:count])
        names = [text.get_text() for text in found["signature"].get_legend().get_texts()]
        assert names == [case.label for case in cases]
        assert len(found["coulomb"].texts) == count

    def test_time_runs_from_the_first_record(self, record, estimate):
        cases = [self.case(record, estimate, number) for number in (0, 1)]
        first, second = panels(friction_figure(cases, "verdict"))["stem"].lines
        assert first.get_xdata()[0] == 0.0
        assert second.get_xdata()[0] == 30.0

    def test_one_alone_needs_no_legend(self, figure):
        assert panels(figure)["signature"].get_legend() is None

    @pytest.mark.parametrize("count", [0, 1 + len(COLOURS)])
    def test_none_or_too_many(self, record, estimate, count):
        cases = [self.case(record, estimate, number) for number in range(count)]
        with pytest.raises(ValueError, match=f"^one to 4 cases can be drawn, got {count}$"):
            friction_figure(cases, "verdict")


def test_case_of_an_estimate(record, estimate):
    case = Case.of("loose", record, estimate)
    assert case.chosen_coulomb_friction == estimate.coulomb_friction
    assert case.threshold == estimate.threshold
    assert math.isclose(case.drive.pascals, 1e3)


class TestPictures:
    def test_png(self, figure, tmp_path):
        """The curves of the three colours of the page, the text and the line are there."""
        path = tmp_path / "figure.png"
        require_picture_file(path)
        figure.savefig(path)
        pixels = np.round(255 * matplotlib.image.imread(path)[..., :3]).astype(int)
        width, height = figure.get_size_inches() * figure.dpi
        assert pixels.shape[:2] == (round(height), round(width))
        blue = [int(COLOURS[0][place : place + 2], 16) for place in (1, 3, 5)]
        assert np.count_nonzero((pixels == blue).all(axis=2)) > 1000
        assert np.count_nonzero((pixels == 255).all(axis=2)) > pixels.shape[0] * pixels.shape[1] / 2

    @pytest.mark.parametrize("name", ["figure.png", "figure.PNG", "figure.pdf", "figure.svg"])
    def test_formats(self, tmp_path, name):
        require_picture_file(tmp_path / name)

    @pytest.mark.parametrize("name", ["figure", "figure.", "figure.csv", "png"])
    def test_no_format(self, tmp_path, name):
        with pytest.raises(ValueError, match=r"not a picture format; choose from .*\.png"):
            require_picture_file(tmp_path / name)

    def test_no_folder(self, tmp_path):
        with pytest.raises(ValueError, match="there is no folder") as refusal:
            require_picture_file(tmp_path / "none" / "figure.png")
        assert str(refusal.value).startswith(str(tmp_path / "none" / "figure.png"))
