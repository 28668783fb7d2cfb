# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the front door offers is copied and pickled, as joblib and Dask do it."""

import copy
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from records import quick_record, simulated

import valve_friction_ros as vf
from valve_friction_ros.health import FrictionLimits
from valve_friction_ros.identification import METHODS
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SensorNoise, TriangleWave
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

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
    found = subprocess.run(
        [sys.executable, "-c", told, str(place)], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == repr(results["plant"])
