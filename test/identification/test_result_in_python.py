# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What people who write Python expect of a result: covariance, bands, models compared, copies."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from processes import printed
from records import quick_record, simulated
from scipy.signal import lfilter

import valve_friction_ros as vf
from valve_friction_ros.health import FrictionLimits
from valve_friction_ros.identification import METHODS, Verdict
from valve_friction_ros.identification.result import (
    Support,
    independent_samples,
    models_compared,
)
from valve_friction_ros.identification.trust.verdict import PRELOAD_SCALE, with_verdict
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SensorNoise, TriangleWave
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

VALVE = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
PRESSURE = 6.5e4 + 5e4 * np.sin(2 * np.pi * np.arange(4000) / 1000)
TRUTH = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
"""Its preload is zero."""


def record_of(seed):
    stem = vf.simulate(VALVE, TRUTH, PRESSURE, 0.01)
    clean = vf.Recording(0.01, PRESSURE, stem.position)
    return vf.SensorNoise(position=5e-6, pressure=50.0, seed=seed).applied_to(clean)


@pytest.fixture(scope="module")
def result():
    return vf.identify(record_of(1), VALVE, "bench")


def test_a_preload_of_zero_can_be_identified(result):
    for one in (result, vf.identify(record_of(2), VALVE, "plant")):
        preload = one.parameters["spring_preload"]
        assert preload.verdict is Verdict.IDENTIFIED
        assert abs(preload.value) < preload.half_width
    assert vf.validate(record_of(3), VALVE, result).fit > 0.99


@pytest.mark.parametrize(
    ("value", "half_width", "verdict", "reason"),
    [
        (0.0, 5.9, Verdict.IDENTIFIED, ""),
        (0.0, 6.1, Verdict.WEAK, "±0.61 % of the range of the actuator force"),
        (0.0, 121.0, Verdict.NOT_IDENTIFIABLE, "wider than its value"),
        (-500.0, 24.9, Verdict.IDENTIFIED, ""),
        (-500.0, 25.1, Verdict.WEAK, "±5 % of its value"),
    ],
)
def test_the_criterion_of_a_preload(value, half_width, verdict, reason):
    """Of an actuator force that ranges over 1000 N: 0.6 % of it, and 5 % of what is larger."""
    scale = PRELOAD_SCALE * 1000.0
    found = with_verdict("spring_preload", value, 1.0, half_width, scale=scale)
    assert found.verdict is verdict
    assert reason in found.reason


class TestCovariance:
    def test_its_diagonal_is_the_standard_error(self, result):
        found = result.covariance()
        assert set(found.index) >= {"viscous_friction", "coulomb_friction", "spring_constant"}
        errors = [result.parameters[name].standard_error for name in found.index]
        assert np.sqrt(np.diag(found)) == pytest.approx(errors)

    def test_it_is_that_of_repeated_records(self, result):
        """The friction at one speed is better known than how it divides into F_c and F_v."""
        values = [vf.identify(record_of(seed), VALVE, "bench").values for seed in range(10, 34)]
        pairs = [(one["coulomb_friction"], one["viscous_friction"]) for one in values]
        seen = np.corrcoef(np.transpose(pairs))[0, 1]
        told = result.correlation().loc["coulomb_friction", "viscous_friction"]
        # Fisher's z of 24 pairs has the deviation 1/sqrt(21).
        assert math.atanh(told) == pytest.approx(math.atanh(seen), abs=3 / math.sqrt(21))

    def test_a_method_without_one_says_so(self):
        published = vf.identify(record_of(1), VALVE, "published")
        with pytest.raises(vf.RefusalError, match="use the method plant or bench"):
            published.covariance()


def test_the_band_holds_the_true_stem_and_is_narrow(result):
    """It is of the model: 95 % of where the true stem may be, without noise."""
    low, high = result.stem_band(PRESSURE, 0.01)
    truth = vf.simulate(VALVE, TRUTH, PRESSURE, 0.01).position
    inside = (low - 1e-6 <= truth) & (truth <= high + 1e-6)
    assert np.mean(inside) > 0.9
    assert 0 < np.max(high - low) < 1e-4
    for draws in (0, 1, 2.5):
        with pytest.raises(ValueError, match=r"^draws must be a whole number of at least 2"):
            result.stem_band(PRESSURE, 0.01, draws)


class TestModels:
    def test_a_model_that_lacks_what_there_is(self, result):
        """No other coordinate makes up for F_v."""
        dry = vf.IdentificationSettings(fixed={"viscous_friction": 0.0})
        without = vf.identify(result.recording, VALVE, dry, "bench")
        compared = result.against(without)
        assert compared.support is Support.VERY_STRONG
        assert compared.log_ratio > 0
        assert compared.free == (6, 5)
        assert compared.independent < compared.samples
        words = str(without.against(result))
        assert words.startswith("the record very strongly favours the second model, which is 1e")
        assert "independent samples" in words

    def test_of_two_records_they_are_refused(self, result):
        with pytest.raises(ValueError, match="different records"):
            result.against(vf.identify(record_of(2), VALVE, "bench"))

    def test_independent_samples(self):
        """x' = a·x + e has the autocorrelation a^k, whose sum over all lags is (1 + a)/(1 - a)."""
        noise = np.random.default_rng(1).normal(size=100_000)
        assert independent_samples(noise) == pytest.approx(1e5, rel=0.1)
        lasting = lfilter([1.0], [1.0, -0.8], noise)
        assert independent_samples(lasting) == pytest.approx(1e5 / 9, rel=0.15)

    def test_two_wrong_models_are_said_to_be(self):
        noise = np.random.default_rng(3).normal(size=1000)
        words = str(models_compared((noise, 2 * noise), (5, 5), (False, False)))
        assert "neither model describes the valve to within noise" in words
        same = models_compared((noise, noise), (5, 5))
        assert str(same).startswith("the record cannot distinguish between the two models; ")
        assert same.log_ratio == 0
        more = models_compared((noise, noise), (5, 6))  # each parameter counts against a model
        assert more.log_ratio == pytest.approx(0.5 * math.log(more.independent))


VALVE_FILE = "diaphragm_area: 0.0445\ntravel: 0.028575\nfixed.mass: 1.6\nwindow: 30.0\n"


def pickled(one):
    return pickle.loads(pickle.dumps(one))


COPIES = pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickled])


@pytest.fixture(scope="module")
def results():
    """A result of each method, at stamps of its own as from a bag."""
    quick = quick_record()
    own = (StampedSignal(quick.time, signal) for signal in (quick.drive, quick.position))
    quick = replace(quick, stamped=StampedRecord(*own))
    triangle = simulated(TriangleWave().sample(np.arange(3000) / 20), 0.05)
    settings = vf.IdentificationSettings(fixed={"mass": 1.6})
    return {
        name: identify(triangle if name == "signature" else quick, BENCH_VALVE, settings)
        for name, identify in METHODS.items()
    }


@COPIES
@pytest.mark.parametrize("method", METHODS)
def test_a_result(results, method, copied):
    result = results[method]
    found = copied(result)
    assert type(found) is vf.Result
    assert found.to_dict() == result.to_dict()
    assert found.summary() == result.summary()
    assert found.settings == result.settings
    assert found.valve == result.valve
    assert found.model == result.model
    np.testing.assert_array_equal(found.recording.position, result.recording.position)
    if method != "published":  # it has no intervals
        assert vf.Baseline.of(found) == vf.Baseline.of(result)
    with pytest.raises(TypeError):
        found.parameters["mass"] = None
    with pytest.raises(ValueError, match="read-only"):
        found.recording.drive[0] = 0.0
    assert found.plot().axes


@COPIES
def test_what_else_the_front_door_offers(results, copied, tmp_path):
    place = tmp_path / "valve.yaml"
    place.write_text(VALVE_FILE)
    for one in (
        BENCH_VALVE,
        LOW_FRICTION,
        SensorNoise(1e-6, 10.0),
        vf.IdentificationSettings(fixed={"mass": 1.6}, stated={"spring_constant": 2e5}),
        vf.Baseline(150.0),
        vf.Baseline.of(results["bench"]),
        vf.read_valve_file(place),
        vf.compare(results["bench"], vf.Baseline(100.0)),
        FrictionLimits(),
    ):
        assert repr(copied(one)) == repr(one)  # nan equals itself there
    recording = results["bench"].recording
    assert copied(recording).sample_period == recording.sample_period
    refusal = copied(vf.RefusalError("the stem did not move"))
    assert str(refusal) == "the stem did not move"
    stem = vf.simulate(BENCH_VALVE, LOW_FRICTION, recording.drive, recording.sample_period)
    np.testing.assert_array_equal(copied(stem).position, stem.position)
    checked = vf.validate(recording, BENCH_VALVE, LOW_FRICTION)
    assert copied(checked).fit == checked.fit


def test_another_process_reads_it_by_pickle_alone(results, tmp_path):
    place = tmp_path / "result.pickle"
    place.write_bytes(pickle.dumps(results["plant"]))
    told = "import pickle, sys; print(repr(pickle.load(open(sys.argv[1], 'rb'))))"
    assert printed("-c", told, place).strip() == repr(results["plant"])
