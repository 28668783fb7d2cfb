# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` as people use it: its table and its picture."""

import dataclasses
import json
import math

import matplotlib.image
import numpy as np
import pytest
from answers import KEYS, row_of

from valve_friction_ros.commands.identify import print_table
from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_bench,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
)

SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file
PNG = b"\x89PNG\r\n\x1a\n"
BENCH = ("--method", "bench")


@pytest.fixture(scope="session")
def result(quick_record):
    return identify_bench(quick_record, BENCH_VALVE, SETTINGS)


class TestTable:
    def test_every_parameter_with_interval_and_verdict(
        self, call, result, quick_csv, bench_options
    ):
        code, out, err = call(quick_csv, *bench_options, *BENCH)
        assert (code, err) == (0, "")
        for name, unit in UNITS.items():
            one = result.parameters[name]
            published = format(result.estimate.values[name], ".6g")
            if math.isnan(one.value):
                assert row_of(out, name) == f"{name} – {unit} not identifiable {published}"
            else:
                size = one.half_width
                digits = f"{size:.0f}" if size >= 100 else f"{size:.2g}"
                said = f"{one.value:.6g} {digits} {unit} {one.verdict.value} {published}"
                assert row_of(out, name) == f"{name} {said}"
        assert "nan" not in out

    def test_fixed_values_have_no_width(self, call, quick_csv, bench_options):
        options = ["--fix", "spring_constant=2.05e5", "--fix", "mass"]
        _, out, _ = call(quick_csv, *bench_options, *options)
        assert row_of(out, "spring_constant") == "spring_constant 205000 N/m fixed 205000"
        assert row_of(out, "mass") == "mass 1.6 kg fixed 1.6"
        assert "fixed: given" not in out

    def test_reasons_fit_and_notes(self, call, printed, result, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, *BENCH)
        words = " ".join(call(quick_csv, *bench_options, *BENCH)[1].split())
        for name, entry in answer["parameters"].items():
            if entry["reason"]:
                assert f"{name} {entry['verdict']}: {entry['reason']}" in words
        misfit = result.misfit
        share = f"{100 * misfit.rms / BENCH_VALVE.travel:.2g} % of travel"
        assert f"fit {100 * misfit.fit:.2f} %: the most probable model's stem is" in words
        assert f"{misfit.rms * 1e6:.3g} µm rms from the measured stem, {share}; " in words
        assert f"; {misfit.systematic * 1e6:.3g} µm of it is not noise" in words
        sweep = answer["evidence"]
        assert f"threshold δv {sweep['threshold']:.4g} m/s, {sweep['samples']} samples" in words
        assert "window 31 samples" in words
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
            parameters={**result.parameters, "coulomb_friction": friction},
        )
        print_table(doubted)
        out = capsys.readouterr().out
        assert row_of(out, "coulomb_friction") == "coulomb_friction – N not identifiable"
        words = " ".join(out.split())
        assert f"coulomb_friction not identifiable: {doubt}" in words
        assert f"note: {doubt}" in words
        assert "nan" not in out


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
            ("record.xyz", "the ending is not a picture format; choose .png, .pdf or .svg"),
            ("no/record.png", "there is no folder"),
        ],
    )
    def test_a_place_it_cannot_go_to(self, call, quick_csv, bench_options, tmp_path, name, message):
        code, out, err = call(quick_csv, *bench_options, "--plot", tmp_path / name)
        assert (code, out) == (2, "")
        assert err.startswith(f"valve_friction identify: {tmp_path / name}: {message}")
        assert err.count("\n") == 1
