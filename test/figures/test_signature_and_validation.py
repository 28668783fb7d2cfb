"""The figures of a valve signature and of a validation: what is drawn is what was found."""

import matplotlib.image
import numpy as np
import pytest

from valve_friction_ros.figures import identification_figure, validation_figure
from valve_friction_ros.identification import identify_signature, validate
from valve_friction_ros.model import BENCH_VALVE, Recording, TriangleWave, simulate


@pytest.fixture(scope="module")
def signature_record(benches):
    """Five strokes at 100 Hz."""
    pressure = TriangleWave().sample(np.arange(15_000) / 100)
    position = simulate(*benches["high"], pressure, 0.01).position
    return Recording(0.01, pressure, position)


@pytest.fixture(scope="module")
def found(signature_record):
    return identify_signature(signature_record, BENCH_VALVE)


def panels(figure):
    return {axes.get_label(): axes for axes in figure.axes}


def lines(axes):
    return {line.get_label(): line for line in axes.lines}


class TestSignature:
    @pytest.fixture(scope="class")
    def figure(self, found):
        return identification_figure(found)

    def test_points(self, figure, found):
        drawn = lines(panels(figure)["signature"])
        for label, points in (
            ("$P_1$", found.signature.upward_points),
            ("$P_2$", found.signature.downward_points),
        ):
            expected = [[1e-3 * one.drive, 1e3 * one.position] for one in points]
            np.testing.assert_allclose(drawn[label].get_xydata(), expected, rtol=1e-12)

    def test_lines_lie_on_the_sliding_stem(self, figure, found):
        """Drawn in kPa and mm: within what the speed's onset leaves, 0.1 kPa."""
        drawn = lines(panels(figure)["signature"])
        for way, label in zip(found.signature.ways, ("up", "down"), strict=True):
            line = drawn[f"slides {label}, slope $S_a$/k"].get_xydata()
            sliding = way[0].sliding
            pressure = 1e-3 * BENCH_VALVE.actuator_drive(sliding.force[[0, -1]])
            np.testing.assert_allclose(line[:, 0], pressure, atol=0.1)
            np.testing.assert_allclose(line[:, 1], 1e3 * sliding.position[[0, -1]])

    def test_stem_and_model(self, figure, found, signature_record):
        measured, model, points = panels(figure)["stem"].lines
        np.testing.assert_array_equal(measured.get_ydata(), signature_record.position * 1e3)
        np.testing.assert_array_equal(model.get_ydata(), found.stem.simulated * 1e3)
        assert points.get_xdata().size == 5

    def test_words(self, figure, found):
        title = " ".join(figure._suptitle.get_text().split())
        assert f"$F_c$ {found.values['coulomb_friction']:.4g} N (weak)" in title
        assert f"fit {100 * found.fit:.2f} %" in title
        assert "dead zone 29.6" in panels(figure)["signature"].get_title()
        assert panels(figure)["signature"].get_xlabel() == "pressure [kPa]"
        assert panels(figure)["signature"].get_ylabel() == "stem [mm]"


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

    def test_title_and_file(self, validation, tmp_path):
        figure = validation_figure(validation, BENCH_VALVE)
        title = " ".join(figure._suptitle.get_text().split())
        assert title.startswith(f"fit {100 * validation.fit:.2f} %; rms ")
        assert "of travel" in title
        figure.savefig(tmp_path / "validation.png")
        assert matplotlib.image.imread(tmp_path / "validation.png").shape[0] > 500
