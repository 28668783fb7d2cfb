# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Figures of a record: what is drawn, read back from the axes."""

import dataclasses
import math
import re

import numpy as np
import pytest

from valve_friction_ros.figures import (
    Case,
    friction_figure,
    identification_figure,
    require_picture_file,
    validation_figure,
)
from valve_friction_ros.figures.panels import COLOURS
from valve_friction_ros.figures.record_figures import (
    comparison_figure,
    evidence_figure,
    noise_figures,
    record_figure,
    residual_figure,
    signature_loop_figure,
)
from valve_friction_ros.identification import (
    Drawing,
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_bench,
    identify_plant,
    identify_published,
    identify_signature,
    validate,
)
from valve_friction_ros.identification.drawing import (
    FRICTION_CURVE,
    IMPERFECTIONS_FOUND,
    friction_drawing,
)
from valve_friction_ros.identification.published.sweep import chosen_region
from valve_friction_ros.model import (
    BENCH_VALVE,
    Drive,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    TriangleWave,
    simulate,
)

NAN = math.nan
LABELS = {"pressure", "stem", "coulomb", "sigma", "signature"}


@pytest.fixture(scope="module")
def record(benches):
    """Four strokes at 100 Hz, with a little noise on both sensors."""
    pressure = SineWave(period=4.0).sample(np.arange(800) / 100)
    position = simulate(BENCH_VALVE, benches["low"].parameters, pressure, 0.01).position
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=1)
    return noise.applied_to(Recording(0.01, pressure, position))


@pytest.fixture(scope="module")
def result(record):
    """What every panel shows at once: the sweep of one method, the simulated stem of another."""
    settings = IdentificationSettings(position_bias=1.13e-3)
    swept = identify_published(record, BENCH_VALVE, settings)
    simulated = identify_bench(record, BENCH_VALVE, settings)
    return dataclasses.replace(
        swept,
        parameters=simulated.parameters,
        stem=simulated.stem,
        misfit=simulated.misfit,
        fit=simulated.fit,
        rms=simulated.rms,
    )


@pytest.fixture(scope="module")
def with_parameters(result):
    """Function of (value, half width, verdict) by name: the result with these instead."""

    def build(**changes):
        changed = {
            name: Parameter(name, value, half_width / 2, half_width, verdict, "reason")
            for name, (value, half_width, verdict) in changes.items()
        }
        return dataclasses.replace(result, parameters={**result.parameters, **changed})

    return build


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


def line(axes, label):
    (found,) = (one for one in axes.lines if one.get_label() == label)
    return found


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

    def test_no_stem_is_simulated_without_a_model(self, result):
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

    @pytest.mark.parametrize(
        ("half_width", "verdict", "words"),
        [(3.5, Verdict.WEAK, "152.2 ± 3.5 N: weak"), (0.0, Verdict.FIXED, "152.25 N: fixed")],
    )
    def test_the_friction_with_its_band_and_verdict(
        self, with_parameters, half_width, verdict, words
    ):
        found = with_parameters(coulomb_friction=(152.25, half_width, verdict))
        axes = panels(identification_figure(found))["coulomb"]
        level = axes.lines[2]
        assert level.get_linestyle() == "--"
        assert set(level.get_ydata()) == {152.25}
        (band,) = axes.patches
        low, high = band.get_extents().transformed(axes.transData.inverted()).intervaly
        assert (low, high) == pytest.approx((152.25 - half_width, 152.25 + half_width))
        (note,) = axes.texts
        assert note.get_text() == f"$F_c$ = {words}"

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
        time = panels(found)["stem"].lines[0].get_xdata()
        assert 20_000 <= time.size < 40_000
        assert time[-1] > many.duration - (time[1] - time[0])


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
        sliding, told = title_of(identification_figure(known)).split("; ", 1)
        assert sliding == "sliding friction 218.0 ± 0.65 N (identified)"
        assert told == (
            "$F_c$ 152.7 ± 1.0 N (identified); $F_v$ 4860 ± 400 N·s/m (weak); $k$ 205000 N/m "
            f"(fixed); dead band 5.2 % of travel; fit {100 * known.misfit.fit:.2f} %"
        )

    def test_the_sliding_friction_comes_first_and_needs_no_split(self, with_parameters):
        found = with_parameters(
            sliding_friction=(53.71, 5.2, Verdict.WEAK),
            coulomb_friction=(NAN, NAN, Verdict.NOT_IDENTIFIABLE),
            viscous_friction=(NAN, NAN, Verdict.NOT_IDENTIFIABLE),
            spring_constant=(2.05e5, 0.0, Verdict.FIXED),
        )
        told = title_of(identification_figure(found)).split("; ")
        assert told[:2] == ["sliding friction 53.7 ± 5.2 N (weak)", "$k$ 205000 N/m (fixed)"]

    def test_a_number_without_a_verdict_is_never_shown(self, with_parameters, result):
        """What is withheld leaves no number in the title, and no line, band or note of it."""
        withheld = dict.fromkeys(result.parameters, (NAN, NAN, Verdict.NOT_IDENTIFIABLE))
        figure = identification_figure(with_parameters(**withheld))
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
        assert ends == pytest.approx([30.0 + record.duration] * 2, abs=record.sample_period)

    @pytest.mark.parametrize("count", [0, 1 + len(COLOURS)])
    def test_none_or_too_many(self, record, result, count):
        cases = [self.case(record, result, number) for number in range(count)]
        with pytest.raises(ValueError, match=f"^one to 4 cases can be drawn, got {count}$"):
            friction_figure(cases, "verdict")


class TestPictures:
    @pytest.mark.parametrize("name", ["figure.png", "figure.PNG", "figure.pdf", "figure.svg"])
    def test_formats(self, tmp_path, name):
        require_picture_file(tmp_path / name)

    @pytest.mark.parametrize(
        ("name", "words"),
        [
            *((one, "the extension is not a picture format; choose .png, .pdf or .svg")
              for one in ("figure", "figure.", "figure.csv", "figure.bmp", "png")),
            ("none/figure.png", "there is no folder"),
        ],
    )  # fmt: skip
    def test_no_place_for_a_picture(self, tmp_path, name, words):
        with pytest.raises(ValueError, match=re.escape(f"{tmp_path / name}: {words}")):
            require_picture_file(tmp_path / name)


SPEED, CURVE_FRICTION = [-4e-3, -1e-3, 2e-3, 8e-3], [-70.0, -55.0, 60.0, 90.0]
CURVE = {
    "speed": SPEED,
    "friction": CURVE_FRICTION,
    "standard_error": [1.0, 2.0, 3.0, 4.0],
    "lag": 0.012,
}
SLIDING_SPEED = 5e-3
MODEL = KarnoppParameters(1.0, 4e3, 50.0, 80.0, 2e5, stribeck_velocity=1e-3)


def parameter(name, value, half_width, withheld=(NAN, NAN)):
    verdict = Verdict.IDENTIFIED if math.isfinite(value) else Verdict.NOT_IDENTIFIABLE
    return Parameter(name, value, half_width / 2, half_width, verdict, withheld=withheld)


def drawn(model=None, lag=None, **numbers):
    """The curves of the panel, for values and half widths by name."""
    parameters = {name: parameter(name, *one) for name, one in numbers.items()}
    evidence = {FRICTION_CURVE: CURVE}
    if lag is not None:
        evidence[IMPERFECTIONS_FOUND] = {"lag": {"value": lag, "half_width": 1e-3}}
    (panel,) = friction_drawing(Drawing(), evidence, parameters, model, SLIDING_SPEED).panels
    return panel.curves


LINEAR = {
    "coulomb_friction": (50.0, 3.0),
    "viscous_friction": (4e3, 500.0),
    "sliding_friction": (70.0, 2.0),
}


class TestLaw:
    def test_the_record_in_millimetres_per_second_with_its_intervals(self):
        bins = drawn()[0]
        np.testing.assert_allclose(bins.x, [-4.0, -1.0, 2.0, 8.0])
        assert bins.y.tolist() == CURVE_FRICTION
        np.testing.assert_allclose(bins.half_width, 1.95996 * np.array([1, 2, 3, 4]), rtol=1e-5)

    def test_the_line_is_that_of_the_result_in_both_directions(self):
        """As far as the fastest bin."""
        _, law, _ = drawn(**LINEAR)
        speed = np.asarray(law.x) / 1e3
        assert (speed.min(), speed.max()) == pytest.approx((-8e-3, 8e-3))
        np.testing.assert_allclose(law.y, np.sign(speed) * (50.0 + 4e3 * np.abs(speed)))

    def test_friction_that_falls_with_speed(self):
        values = {
            "coulomb_friction": (50.0, 1.0),
            "viscous_friction": (4e3, 100.0),
            "static_friction": (80.0, 7.0),
            "stribeck_velocity": (1e-3, 1e-4),
        }
        law = drawn(**values)[1]
        np.testing.assert_allclose(law.y, MODEL.sliding_friction(np.asarray(law.x) / 1e3))
        middle = np.asarray(law.x).size // 2
        assert law.y[middle] == pytest.approx(80.0, rel=1e-3)

    def test_the_band_holds_the_intervals_that_are_known(self):
        """That of F_c at rest, that of the sliding friction at its speed."""
        _, law, _ = drawn(**LINEAR)
        speed = np.asarray(law.x) / 1e3
        band = np.interp([1e-6, SLIDING_SPEED], speed, law.half_width)
        np.testing.assert_allclose(band, [3.0, 2.0], rtol=2e-3)
        assert law.label == "fitted law ± 95 %"

    def test_no_band_where_an_interval_is_unknown(self):
        _, law = drawn(MODEL, viscous_friction=(NAN, NAN), coulomb_friction=(50.0, 3.0))
        assert np.isnan(law.half_width).all()
        assert law.label == "fitted law"

    def test_a_withheld_value_is_drawn_with_its_interval(self):
        withheld = {**LINEAR, "viscous_friction": (NAN, NAN, (4e3, 5e3))}
        _, law, _ = drawn(**withheld)
        speed = np.asarray(law.x) / 1e3
        np.testing.assert_allclose(np.abs(law.y), 50.0 + 4e3 * np.abs(speed))
        assert np.isfinite(law.half_width).all()

    def test_the_sliding_friction_at_its_speed_both_ways(self):
        *_, sliding = drawn(**LINEAR)
        assert sliding.x == [-5.0, 5.0]
        assert (sliding.y, sliding.half_width) == ([-70.0, 70.0], [2.0, 2.0])
        assert sliding.label == "sliding friction 70.0 ± 2.0 N"

    def test_a_record_without_a_curve_has_no_panel(self):
        assert friction_drawing(Drawing(), {FRICTION_CURVE: {}}, {}, MODEL, NAN).panels == ()

    def test_the_record_is_shown_with_the_lag_of_the_fit(self):
        """A stem that is seen 2 ms later looks as one with F_v less by k·2 ms."""
        bins = drawn(lag=0.010, spring_constant=(2e5, 1e3))[0]
        np.testing.assert_allclose(bins.y, np.add(CURVE_FRICTION, 400.0 * np.array(SPEED)))
        assert drawn(lag=0.010)[0].y.tolist() == CURVE_FRICTION


@pytest.fixture(scope="module")
def rested(record):
    """The record between rests of 6 s and 3 s."""
    ends = (600, 300)
    quiet = SensorNoise(position=10e-6, pressure=100.0, seed=2)
    padded = Recording(
        0.01, *(np.pad(one, ends, "edge") for one in (record.drive, record.position))
    )
    return identify_plant(quiet.applied_to(padded), BENCH_VALVE)


class TestFigure:
    @pytest.fixture(scope="class")
    def figure(self, rested):
        return identification_figure(rested)

    def test_it_takes_the_place_of_the_published_sweep(self, rested, figure):
        assert rested.estimate is not None
        assert {*panels(figure)} == {"pressure", "stem", "friction", "signature"}
        axes = panels(figure)["friction"]
        assert axes.get_xlabel() == "stem speed [mm/s]"
        assert axes.get_ylabel() == "friction [N]"

    def test_the_model_is_drawn_at_its_own_time(self, rested, figure):
        """Rests before and after the motion are not simulated."""
        measured, model = panels(figure)["stem"].lines
        assert model.get_linestyle() == ":"
        time, position = model.get_data()
        assert time[0] > 3.0
        assert time[-1] < measured.get_xdata()[-1] - 0.5
        apart = position - np.interp(time, *measured.get_data())
        assert np.sqrt(np.mean(apart**2)) == pytest.approx(rested.rms * 1e3, rel=0.3)

    def test_a_case_without_a_curve_beside_one_that_has_it(self, rested):
        bare = dataclasses.replace(rested, exhibit=None, evidence={})
        cases = [Case.of("none", bare), Case.of("curve", rested)]
        axes = panels(friction_figure(cases, "two"))["friction"]
        assert len(axes.get_legend().get_texts()) == 3


@pytest.fixture(scope="module")
def signature_record(benches):
    """Five strokes at 100 Hz."""
    pressure = TriangleWave().sample(np.arange(15_000) / 100)
    position = simulate(*benches["high"], pressure, 0.01).position
    return Recording(0.01, pressure, position)


@pytest.fixture(scope="module")
def found(signature_record):
    return identify_signature(signature_record, BENCH_VALVE)


class TestSignature:
    @pytest.fixture(scope="class")
    def figure(self, found):
        return identification_figure(found)

    def test_points(self, figure, found):
        for label, some in (
            ("$P_1$", found.signature.upward_points),
            ("$P_2$", found.signature.downward_points),
        ):
            expected = [[1e-3 * one.drive, 1e3 * one.position] for one in some]
            drawn = line(panels(figure)["signature"], label)
            np.testing.assert_allclose(drawn.get_xydata(), expected, rtol=1e-12)

    def test_lines_lie_on_the_sliding_stem(self, figure, found):
        """Drawn in kPa and mm: within what the speed's onset leaves, 0.1 kPa."""
        for way, label in zip(found.signature.ways, ("up", "down"), strict=True):
            drawn = line(panels(figure)["signature"], f"slides {label}, slope $S_a$/k")
            sliding = way[0].sliding
            pressure = 1e-3 * BENCH_VALVE.actuator_drive(sliding.force[[0, -1]])
            np.testing.assert_allclose(drawn.get_xdata(), pressure, atol=0.1)
            np.testing.assert_allclose(drawn.get_ydata(), 1e3 * sliding.position[[0, -1]])


class TestValidation:
    @pytest.fixture(scope="class")
    def validation(self, benches, signature_record):
        return validate(signature_record, BENCH_VALVE, benches["low"].parameters)

    def test_what_is_drawn(self, validation):
        drawn = panels(validation_figure(validation, BENCH_VALVE))
        measured, simulated = drawn["stem"].lines
        np.testing.assert_array_equal(measured.get_ydata(), validation.recording.position * 1e3)
        np.testing.assert_array_equal(simulated.get_ydata(), validation.simulated * 1e3)
        (residual,) = drawn["residual"].lines
        np.testing.assert_array_equal(residual.get_ydata(), validation.residual * 1e3)
        (pressure,) = drawn["pressure"].lines
        np.testing.assert_array_equal(pressure.get_ydata(), validation.recording.pressure / 1e3)
        assert drawn["pressure"].get_xlabel() == "time [s]"
        assert "[mm]" in drawn["stem"].get_ylabel()


MILLIMETRE = 1 / 25.4
PRINTABLE = 180.0  # mm between the margins of an A4 page


@pytest.fixture(scope="module")
def figures(record, result):
    comparison = result.stem
    return {
        "record": record_figure(record),
        "loop": signature_loop_figure(result),
        "sweep": evidence_figure(result.drawing),
        "comparison": comparison_figure(comparison),
        "residual": residual_figure(comparison),
        **dict(zip(("histogram", "correlation"), noise_figures(comparison), strict=True)),
    }


@pytest.mark.parametrize("name", ["record", "loop", "sweep", "comparison", "residual"])
def test_every_axis_has_its_unit_and_the_width_fits(figures, name):
    figure = figures[name]
    assert 0.95 * PRINTABLE * MILLIMETRE < figure.get_figwidth() <= 1.01 * PRINTABLE * MILLIMETRE
    assert figure.axes
    for axes in figure.axes:
        assert "[" in axes.get_ylabel() or axes.get_ylabel() == "samples"
        shown = axes.get_subplotspec().is_last_row()
        assert ("[" in axes.get_xlabel()) == shown


def test_the_loop_of_the_baseline_lies_below_that_of_now(record, result):
    healthy = Recording(0.01, record.pressure * 1.1, record.position)
    (axes,) = signature_loop_figure(result, healthy).axes
    before, now = axes.lines
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["baseline", "now"]
    np.testing.assert_allclose(before.get_xdata(), healthy.pressure / 1e3)
    np.testing.assert_allclose(now.get_xdata(), record.pressure / 1e3)
    assert before.get_color() != now.get_color()


def test_the_sweep_marks_choice_and_region_in_every_panel(figures, result):
    threshold = result.estimate.threshold
    low, high = chosen_region(result.estimate.sweep, threshold)
    assert low <= threshold <= high
    for axes in figures["sweep"].axes:
        spans = [patch.get_extents() for patch in axes.patches]
        edges = [axes.transData.inverted().transform(span)[:, 0] for span in spans]
        assert any(np.allclose(edge, (low, high)) for edge in edges)
        assert any(threshold in np.asarray(line.get_xdata()) for line in axes.lines)


def test_comparison_and_residual_belong_together(figures, result):
    measured, simulated = map(points, figures["comparison"].axes[0].lines)
    assert len(figures["comparison"].legends) == 1
    residual = points(figures["residual"].axes[0].lines[0])
    np.testing.assert_allclose(residual[1] / 1e3, simulated[1] - measured[1], atol=1e-9)
    np.testing.assert_allclose(residual[1], result.stem.residual * 1e6, atol=1e-6)
    assert figures["correlation"].axes[0].lines[0].get_ydata()[0] == 1
