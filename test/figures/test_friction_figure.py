"""The figure of an identification: what is drawn, and in which units."""

import dataclasses
import math

import matplotlib.image
import numpy as np
import pytest

from valve_friction_ros.figures import (
    Case,
    friction_figure,
    identification_figure,
    require_picture_file,
)
from valve_friction_ros.figures.page import titled_figure
from valve_friction_ros.figures.panels import COLOURS
from valve_friction_ros.identification import Verdict
from valve_friction_ros.model import BENCH_VALVE, Drive, Recording, Valve

NAN = math.nan
LABELS = {"pressure", "stem", "coulomb", "sigma", "signature"}


@pytest.fixture(scope="module")
def figure(result):
    return identification_figure(result)


def panels(figure):
    """The axes of a figure by name."""
    return {axes.get_label(): axes for axes in figure.axes}


def title_of(figure):
    return " ".join(figure._suptitle.get_text().split())


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
            "coulomb": ("", "Coulomb friction $F_c$ [N]"),
            "sigma": ("threshold δv [m/s]", "$\\sigma_s$ [N]"),
            "signature": ("pressure [kPa]", "stem [mm]"),
        }
        for upper, lower in (("pressure", "stem"), ("coulomb", "sigma")):
            assert found[upper].get_shared_x_axes().joined(found[upper], found[lower])

    def test_the_record_is_drawn_in_these_units(self, figure, record):
        found = panels(figure)
        (pressure,), (stem, _) = found["pressure"].lines, found["stem"].lines
        (signature,) = found["signature"].lines
        kilopascals, millimetres = record.pressure / 1e3, record.position * 1e3
        np.testing.assert_array_equal(points(pressure), [record.time, kilopascals])
        np.testing.assert_array_equal(points(stem), [record.time, millimetres])
        np.testing.assert_array_equal(points(signature), [kilopascals, millimetres])

    def test_the_refined_stem_lies_on_the_measured_one(self, figure, record, result):
        """Dotted over the whole record, and no further away than the noise."""
        _, refined = panels(figure)["stem"].lines
        assert refined.get_linestyle() == ":"
        time, position = points(refined)
        assert (time[0], time[-1]) == (record.time[0], record.time[-1])
        measured = np.interp(time, record.time, record.position * 1e3)
        rms = np.sqrt(np.mean((position - measured) ** 2))
        assert rms == pytest.approx(result.misfit.rms * 1e3, rel=1e-9)
        assert rms < 12e-3

    def test_there_is_none_without_a_refined_model(self, result):
        """As of a machine without a spring."""
        regressed = dataclasses.replace(result, stem=None, misfit=None, rms=math.nan)
        found = identification_figure(regressed)
        assert len(panels(found)["stem"].lines) == 1
        assert "fit" not in title_of(found)

    def test_the_published_sweep_with_the_chosen_threshold(self, figure, result):
        published = result.estimate
        sweep, marker, _ = panels(figure)["coulomb"].lines
        expected = [published.sweep.thresholds, published.sweep.estimates["coulomb_friction"]]
        np.testing.assert_array_equal(points(sweep), expected)
        chosen = [[published.threshold], [published.coulomb_friction]]
        np.testing.assert_array_equal(points(marker), chosen)
        sigma, upright = panels(figure)["sigma"].lines
        np.testing.assert_array_equal(points(sigma)[0], published.sweep.thresholds)
        assert set(upright.get_xdata()) == {published.threshold}

    def test_a_method_without_a_sweep_has_none_to_draw(self, result):
        alone = dataclasses.replace(result, exhibit=None)
        assert Case.of("recording", alone).drawing.panels == ()
        assert {*panels(identification_figure(alone))} == {"pressure", "stem", "signature"}

    def test_the_refined_friction_with_its_band_and_verdict(self, with_parameters):
        found = with_parameters(coulomb_friction=(152.25, 3.5, Verdict.WEAK))
        axes = panels(identification_figure(found))["coulomb"]
        level = axes.lines[2]
        assert level.get_linestyle() == "--"
        assert set(level.get_ydata()) == {152.25}
        (band,) = axes.patches
        low, high = band.get_extents().transformed(axes.transData.inverted()).intervaly
        assert (low, high) == (pytest.approx(148.75), pytest.approx(155.75))
        (note,) = axes.texts
        assert note.get_text() == "$F_c$ = 152.2 ± 3.5 N: weak"

    def test_a_given_friction_has_no_interval(self, with_parameters):
        found = with_parameters(coulomb_friction=(152.5, 0.0, Verdict.FIXED))
        (note,) = panels(identification_figure(found))["coulomb"].texts
        assert note.get_text() == "$F_c$ = 152.5 N: fixed"

    @pytest.mark.parametrize("coulomb", [40.0, 152.0, 1520.0])
    def test_both_frictions_are_in_sight(self, with_parameters, coulomb):
        found = with_parameters(coulomb_friction=(coulomb, 1.0, Verdict.IDENTIFIED))
        axes = panels(identification_figure(found))["coulomb"]
        low, high = axes.get_ylim()
        assert low < coulomb < high
        assert low < found.estimate.coulomb_friction < high

    def test_force_of_a_machine_without_diaphragm(self, record, result):
        force = dataclasses.replace(record, driven_by=Drive.FORCE)
        found = panels(identification_figure(dataclasses.replace(result, recording=force)))
        assert found["pressure"].get_ylabel() == "drive force [N]"
        assert found["signature"].get_xlabel() == "drive force [N]"
        np.testing.assert_array_equal(found["pressure"].lines[0].get_ydata(), record.pressure)

    def test_long_records_are_thinned(self, record, result):
        """Not below 20000 points, and to their whole length."""
        many = Recording(1e-3, np.tile(record.pressure, 60), np.tile(record.position, 60))
        found = identification_figure(dataclasses.replace(result, recording=many))
        line = panels(found)["stem"].lines[0]
        assert 20_000 <= line.get_xdata().size < 40_000
        step = line.get_xdata()[1] - line.get_xdata()[0]
        assert line.get_xdata()[-1] > many.duration - step


class TestVerdict:
    @pytest.fixture
    def known(self, with_parameters):
        return with_parameters(
            coulomb_friction=(152.7, 1.0, Verdict.IDENTIFIED),
            static_friction=(NAN, NAN, Verdict.NOT_IDENTIFIABLE),
            viscous_friction=(4865.0, 400.0, Verdict.WEAK),
            spring_constant=(2.05e5, 0.0, Verdict.FIXED),
        )

    def test_each_number_has_its_verdict(self, known):
        """2·152.7 N over 2.05e5 N/m and 28.575 mm is 5.2 %."""
        known = dataclasses.replace(known, warnings=())
        assert title_of(identification_figure(known)) == (
            "$F_c$ 152.7 N (identified); $F_v$ 4865 N·s/m (weak); $k$ 205000 N/m (fixed); "
            f"dead band 5.2 % of travel; fit {100 * known.misfit.fit:.2f} %"
        )

    def test_a_number_without_a_verdict_is_never_shown(self, nothing_known):
        """What is withheld leaves no number in the title, and no line, band or note of it."""
        figure = identification_figure(nothing_known)
        told = title_of(figure).split("; ")[:3]
        assert told == [f"${name}$ not identifiable" for name in ("F_c", "F_v", "k")]
        assert "dead band" not in title_of(figure)
        axes = panels(figure)["coulomb"]
        (note,) = axes.texts
        assert note.get_text() == "$F_c$ not identifiable"
        assert len(axes.lines) == 2
        assert not axes.patches
        everything = " ".join([title_of(figure), *(t.get_text() for t in axes.texts)])
        assert "nan" not in everything

    def test_warnings_are_told(self, known):
        """Below the panels, and as they are, not as maths: they may hold text from outside."""
        doubt = "the Karnopp model does not describe this valve: 98 µm are not noise"
        doubted = dataclasses.replace(known, warnings=(doubt, r"check $\foo{$ and $x^2$"))
        figure = identification_figure(doubted)
        assert figure._supxlabel.get_text() == f"note: {doubt}\nnote: check $\\foo{{$ and $x^2$"
        assert doubt not in title_of(figure)
        figure.draw_without_rendering()

    def test_many_and_long_warnings_stay_within_the_page(self, known):
        doubted = dataclasses.replace(known, warnings=("many words " * 20, *"abcd"))
        figure = identification_figure(doubted)
        figure.draw_without_rendering()
        for text in (figure._suptitle, figure._supxlabel):
            box = text.get_window_extent()
            assert figure.bbox.x0 < box.x0 < box.x1 < figure.bbox.x1
        told = figure._supxlabel.get_text().splitlines()
        assert len(told) == 5
        assert told[-1] == "and 2 more notes, which the command prints"

    def test_one_warning_more_than_fits_is_told(self, known):
        """A line that counts it would need as much room."""
        told = identification_figure(dataclasses.replace(known, warnings=(*"abcd",)))
        assert told._supxlabel.get_text().splitlines() == [f"note: {one}" for one in "abcd"]

    def test_a_number_keeps_its_percent_sign(self):
        """Wherever the line of a title breaks."""
        for length in range(85, 100):
            title = f"{'x' * length} 14 % of travel"
            lines = titled_figure(title)._suptitle.get_text().splitlines()
            assert not any(line.startswith("%") for line in lines)

    def test_the_friction_stands_clear_of_the_sweep(self, known):
        """No point of the curve lies below the words that name F_c."""
        figure = identification_figure(known)
        figure.draw_without_rendering()
        axes = panels(figure)["coulomb"]
        (note,) = axes.texts
        box = note.get_window_extent()
        curve = axes.transData.transform(points(axes.lines[0]).T)
        covered = [box.contains(x, y) for x, y in curve]
        assert len(covered) > 100
        assert not any(covered)

    def test_the_scale_of_sigma_can_be_read(self, known):
        figure = identification_figure(known)
        figure.draw_without_rendering()
        axes = panels(figure)["sigma"]
        low, high = axes.get_ylim()
        ticks = [tick for tick in axes.get_yticks() if low <= tick <= high]
        assert len(ticks) >= 3
        assert all(label.get_text() for label in axes.get_yticklabels())

    def test_the_model_is_seen_on_the_measured_stem(self, known):
        """Also in black and white: a thin dark line on a wide pale one."""
        measured, model = panels(identification_figure(known))["stem"].lines
        assert measured.get_linewidth() > 2 * model.get_linewidth()
        assert measured.get_alpha() < 0.5
        assert model.get_color() == "k"

    def test_beyond_the_travel(self, with_parameters):
        tight = with_parameters(
            coulomb_friction=(4e3, 1.0, Verdict.IDENTIFIED),
            static_friction=(4e3, 1.0, Verdict.IDENTIFIED),
            spring_constant=(2.05e5, 0.0, Verdict.FIXED),
        )
        title = title_of(identification_figure(tight))
        assert "dead band 137 % of travel" in title

    def test_without_a_travel(self, result):
        endless = Valve(BENCH_VALVE.diaphragm_area, BENCH_VALVE.pressure_reference)
        assert "dead band" not in title_of(
            identification_figure(dataclasses.replace(result, valve=endless))
        )


class TestSeveralCases:
    def case(self, record, result, number):
        later = Recording(0.01, record.pressure, record.position, 100.0 + 30.0 * number)
        return Case.of(f"case {number}", dataclasses.replace(result, recording=later))

    @pytest.mark.parametrize("count", [2, len(COLOURS)])
    def test_each_has_its_line_colour_and_name(self, record, result, count):
        cases = [self.case(record, result, number) for number in range(count)]
        found = panels(friction_figure(cases, "verdict"))
        for name in ("pressure", "stem", "signature"):
            drawn = [line.get_color() for line in found[name].lines if line.get_linestyle() == "-"]
            assert drawn == list(COLOURS[:count])
        names = [text.get_text() for text in found["signature"].get_legend().get_texts()]
        assert names == [case.label for case in cases]
        assert len(found["coulomb"].texts) == count

    def test_time_runs_from_the_first_record(self, record, result):
        cases = [self.case(record, result, number) for number in (0, 1)]
        lines = panels(friction_figure(cases, "verdict"))["stem"].lines
        assert [line.get_xdata()[0] for line in lines] == [0.0, 0.0, 30.0, 30.0]
        ends = [line.get_xdata()[-1] for line in lines[2:]]
        assert ends == pytest.approx([30.0 + record.duration] * 2, rel=1e-12)

    def test_one_alone_needs_no_legend(self, figure):
        assert panels(figure)["signature"].get_legend() is None

    @pytest.mark.parametrize("count", [0, 1 + len(COLOURS)])
    def test_none_or_too_many(self, record, result, count):
        cases = [self.case(record, result, number) for number in range(count)]
        with pytest.raises(ValueError, match=f"^one to 4 cases can be drawn, got {count}$"):
            friction_figure(cases, "verdict")


def test_case_of_a_result(result):
    case = Case.of("loose", result)
    coulomb, sigma, _ = case.drawing.panels
    assert coulomb.curves[1].y == [result.estimate.coulomb_friction]
    assert sigma.chosen == result.estimate.threshold
    assert coulomb.level is result.parameters["coulomb_friction"]
    assert case.simulated is result.stem.simulated
    assert case.recording.driven_by is Drive.PRESSURE


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

    @pytest.mark.parametrize("name", ["figure", "figure.", "figure.csv", "figure.gif", "png"])
    def test_no_format(self, tmp_path, name):
        with pytest.raises(
            ValueError, match=r"the ending is not a picture format; choose \.png, \.pdf or \.svg$"
        ):
            require_picture_file(tmp_path / name)

    def test_no_folder(self, tmp_path):
        with pytest.raises(ValueError, match="there is no folder") as refusal:
            require_picture_file(tmp_path / "none" / "figure.png")
        assert str(refusal.value).startswith(str(tmp_path / "none" / "figure.png"))
