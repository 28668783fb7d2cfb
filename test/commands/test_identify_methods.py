# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` on a real machine and on a valve signature."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from answers import none_for_nan, values

from valve_friction_ros.identification import (
    IdentificationSettings,
    identify_signature,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    Recording,
    TriangleWave,
    simulate,
)

EMPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "emps" / "emps_identification.csv"
PUBLISHED = {  # IDIM-LS
    "mass": 95.1089,
    "viscous_friction": 203.5034,
    "coulomb_friction": 20.3935,
    "spring_preload": -3.1648,
}
PNG = b"\x89PNG\r\n\x1a\n"
SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file


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
        assert {answer[key] for key in ("rms", "systematic_misfit")} == {None}
        assert answer["model_describes"] is True
        assert 0.9 < answer["fit"] < 1.0
        assert answer["parameters"]["spring_constant"]["verdict"] == "fixed"
        assert answer["evidence"]["published_window"] == 31

    def test_by_its_own_headers(self, printed, recorded):
        names = EMPS.read_text().split("\n", 1)[0].split(",")
        options = ["--time-column", names[0], "--force-column", names[1]]
        options += ["--position-column", names[2], "--fix", "spring_constant=0"]
        assert printed(EMPS, *options) == printed(recorded, "--fix", "spring_constant=0")


class TestSignature:
    """A signature by ``--method signature``, as the library identifies it."""

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
        evidence = answer["evidence"]
        assert evidence["position_bias"] == pytest.approx(signature.position_bias, rel=1e-6)
        assert evidence["dead_zone"] == pytest.approx(signature.dead_zone, rel=1e-9)
        points = [(one["direction"], one["time"]) for one in evidence["breakaway_points"]]
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
