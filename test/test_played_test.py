# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A stroke test as it is played: set points in time, and everything that ends it."""

import math

import numpy as np
import pytest

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import SampledPressure
from valve_friction_ros.planning.played_test import Abort, PlayedTest, PlayLimits, PlayPhase

SIGNAL = SampledPressure(np.array([0.0, 1.0, 3.0, 5.0]), np.array([1e5, 1e5, 1.4e5, 1e5]))
LIMITS = PlayLimits((0.002, 0.020), (0.9e5, 1.5e5), silence=0.5)
STEP = 0.05


def ready():
    """A test whose signals have just come, at time 100 s."""
    test = PlayedTest(SIGNAL, LIMITS)
    hear(test, 100.0)
    return test


def hear(test, now, position=0.010, pressure=1.1e5):
    test.heard_stem(position, now)
    test.heard_pressure(pressure, now)


def play(test, begin, end):
    """Play with good signals; return times and set points."""
    found = []
    for now in np.arange(begin, end, STEP):
        hear(test, now)
        found.append((now, test.step(now)))
    return np.array(found, dtype=float)


def test_nothing_is_set_before_somebody_starts_it():
    test = ready()
    assert [test.step(100.0 + k) for k in range(50)] == [None] * 50
    assert test.phase is PlayPhase.WAITING


def test_the_set_points_are_those_of_the_file_and_the_last_one_stays():
    test = ready()
    test.start(100.0)
    found = play(test, 100.0, 110.0)
    np.testing.assert_allclose(found[:, 1], SIGNAL.sample(np.minimum(found[:, 0] - 100.0, 5.0)))
    assert test.phase is PlayPhase.ENDED
    assert str(test) == "played to its end"


@pytest.mark.parametrize(
    ("change", "why", "words"),
    [
        (
            {"position": 0.0201},
            Abort.POSITION,
            "the stem was at 0.0201 m, beyond its limit of 0.02",
        ),
        ({"position": 0.0019}, Abort.POSITION, "beyond its limit of 0.002 m"),
        ({"position": math.nan}, Abort.POSITION, "the stem was at nan m"),
        ({"pressure": 1.51e5}, Abort.PRESSURE, "151000 Pa, beyond its limit of 150000 Pa"),
        ({"pressure": 0.89e5}, Abort.PRESSURE, "beyond its limit of 90000 Pa"),
    ],
)
def test_a_violation_goes_back_with_the_next_set_point(change, why, words):
    """Though the sample after it is good again."""
    test = ready()
    test.start(100.0)
    play(test, 100.0, 102.0)
    hear(test, 102.0, **change)
    hear(test, 102.01)
    assert test.step(102.02) == test.home == 1e5
    assert (test.phase, test.aborted) == (PlayPhase.BACK, why)
    assert words in str(test)
    hear(test, 103.0)
    assert test.step(103.0) == 1e5
    assert test.aborted is why


@pytest.mark.parametrize(
    ("name", "why"), [("stem", Abort.SILENT_STEM), ("pressure", Abort.SILENT_PRESSURE)]
)
def test_a_signal_that_is_lost_goes_back_after_its_silence(name, why):
    test = ready()
    test.start(100.0)
    now = 100.0
    while test.phase is PlayPhase.PLAYING:
        now += STEP
        if name == "stem":
            test.heard_pressure(1.1e5, now)
        else:
            test.heard_stem(0.01, now)
        test.step(now)
    assert test.aborted is why
    assert 100.0 + LIMITS.silence < now <= 100.0 + LIMITS.silence + 2 * STEP


def test_a_player_that_stood_still_goes_back_in_place_of_a_jump():
    test = ready()
    test.start(100.0)
    play(test, 100.0, 101.0)
    hear(test, 102.5)
    assert test.step(102.5) == test.home
    assert test.aborted is Abort.HELD_UP


@pytest.mark.parametrize("why", [Abort.ASKED, Abort.SHUTDOWN])
def test_who_asks_gets_it_back_at_once(why):
    test = ready()
    test.start(100.0)
    play(test, 100.0, 102.0)
    test.abort(why)
    hear(test, 102.0)
    assert test.step(102.0) == test.home
    assert test.aborted is why


def test_it_can_be_started_again_after_each_end_and_not_while_it_plays():
    test = ready()
    test.start(100.0)
    with pytest.raises(RefusalError, match="is being played"):
        test.start(100.0)
    test.abort(Abort.ASKED)
    hear(test, 200.0)
    test.start(200.0)
    assert test.aborted is None
    assert play(test, 200.0, 204.0)[-1, 1] == pytest.approx(1e5 + 0.4e5 * 1.05 / 2, rel=1e-3)


@pytest.mark.parametrize(
    ("stem", "pressure", "cause"),
    [
        (None, 1.1e5, "no stem position arrived"),
        (0.01, None, "no pressure arrived"),
        (0.03, 1.1e5, "beyond its limit of 0.02 m"),
        (0.01, 2e5, "beyond its limit of 150000 Pa"),
    ],
)
def test_it_does_not_start_on_signals_that_would_end_it(stem, pressure, cause):
    test = PlayedTest(SIGNAL, LIMITS)
    if stem is not None:
        test.heard_stem(stem, 100.0)
    if pressure is not None:
        test.heard_pressure(pressure, 100.0)
    with pytest.raises(RefusalError, match=cause) as refusal:
        test.start(100.0)
    assert str(refusal.value).startswith("nothing is set: ")
    assert test.step(100.0) is None


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        (((0.02, 0.02), (0.0, 1e5)), "limits of the position"),
        (((0.0, 0.02), (0.0, math.inf)), "limits of the pressure"),
        (((0.0, 0.02), (0.0, 1e5), 0.0), "silence must be above 0 s"),
    ],
)
def test_limits_that_end_nothing_are_refused(limits, message):
    with pytest.raises(ValueError, match=message):
        PlayLimits(*limits)


def test_a_test_that_takes_too_long_is_refused():
    with pytest.raises(ValueError, match="takes 5 s, and 4 s are allowed"):
        PlayedTest(SIGNAL, PlayLimits((0.0, 0.02), (0.0, 1e5), duration=4.0))
