# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Any record gives a result or is refused: short, empty, slow or broken, by every method.

Whatever else is raised would reach a user as an internal error, and so would a warning of numpy.
"""

import io
import math
import warnings
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import event, example, given, settings
from hypothesis import strategies as st
from records import quick_record, simulated, square_record, stroked_record

from valve_friction_ros.commands.main import run
from valve_friction_ros.health import (
    FrictionMonitor,
    MonitorSettings,
    RefusedRecordError,
    identify_snapshot,
)
from valve_friction_ros.identification import (
    METHODS,
    IdentificationSettings,
    RefusalError,
    Result,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    Drive,
    Recording,
    TriangleWave,
    Valve,
)
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.streams import Arrivals, Kind

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

EXTREMES = (0.0, -1e-320, 1e-300, 1e-12, 1e12, -1e15, 1e100, 1.7e308, -1.7e308)
VALVES = (
    *5 * (BENCH_VALVE,),
    *2 * (Valve(diaphragm_area=0.0445),),
    replace(BENCH_VALVE, travel=1e-9),
    Valve(diaphragm_area=1e-12, travel=1e9),
)
SETTINGS = (
    *3 * (IdentificationSettings(),),
    IdentificationSettings(fixed={"mass": 1.6}, timing_uncertainty=0.0),
    IdentificationSettings(fixed={"spring_constant": 0.0}),
    IdentificationSettings(fixed={"spring_constant": 2e5, "spring_preload": 0.0}),
    IdentificationSettings(fixed={"static_friction": 150.0, "coulomb_friction": 150.0}),
    IdentificationSettings(fixed={"limit_velocity": 1e3}),
    IdentificationSettings(position_bias=1.1e-3, area_uncertainty=0.02),
    IdentificationSettings(derivative_window=5, order=3, steps=3, resolution=4),
)


HEALTHY = {
    "triangle": lambda: simulated(TriangleWave().sample(np.arange(3000) / 20), 0.05),
    "quick": quick_record,
    "square": square_record,
    "stroked": stroked_record,
}


@cache
def healthy(name):
    """A record that one method or more identify."""
    return HEALTHY[name]()


def _from(signal, random):
    """Return which samples come after a drawn one, and its value."""
    begin = random.integers(signal.size)
    return np.arange(signal.size) > begin, signal[begin]


def _rounded(signal, random):
    step = max(float(np.ptp(signal)), 1e-100) / random.choice([1, 2, 3, 20, 255])
    return np.floor_divide(signal, step) * step


def _spiked(signal, random):
    damaged = signal.copy()
    damaged[random.integers(signal.size)] = random.choice(EXTREMES)
    return damaged


rarely = st.sampled_from((*19 * (False,), True))

DAMAGES = (
    _rounded,
    _spiked,
    lambda signal, random: signal * 10.0 ** random.integers(-12, 13),  # another unit
    lambda signal, random: signal + np.where(_from(signal, random)[0], 0.0, 1e5),
    lambda signal, random: np.where(*_from(signal, random), signal),  # frozen
    lambda signal, random: np.where(_from(signal, random)[0], signal, signal[0]),
    lambda signal, random: np.repeat(signal[:: random.integers(2, 60)], 60)[: signal.size],
    lambda signal, random: (
        signal + random.choice([1e-6, 1.0, 1e3]) * random.standard_normal(signal.size)
    ),
    lambda signal, random: np.full(signal.size, random.choice([signal[0], *EXTREMES])),
    lambda signal, random: random.choice([signal[0], signal[-1]], signal.size),
    lambda signal, _: -signal,
    lambda signal, _: np.sort(signal),
)


@st.composite
def broken_signals(draw):
    """Period, drive and position of a stretch of a healthy record, damaged; or of any numbers."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if draw(rarely):
        count = draw(st.integers(1, 40))
        numbers = st.lists(
            st.floats(allow_nan=False, allow_infinity=False), min_size=count, max_size=count
        )
        drive, position = np.array(draw(numbers)), np.array(draw(numbers))
        return draw(st.sampled_from((1e-300, 1e-9, 0.01, 60.0, 1e9, 1e300))), drive, position
    record = healthy(draw(st.sampled_from(tuple(HEALTHY))))
    stride = draw(st.sampled_from((1, 1, 1, 2, 7, 40)))
    count = draw(st.sampled_from((3200, 400, 311, 310, 99, 61, 32, 31, 30, 9, 5, 4, 3, 2, 1)))
    count = draw(st.sampled_from((count, 500, 800, 3200)))
    begin = draw(st.sampled_from((0, len(record) // 3, len(record) - 2)))
    chosen = slice(begin, None, stride)
    signals = [signal[chosen][:count] for signal in (record.drive, record.position)]
    if draw(st.booleans()):  # a long one out of a short one
        signals = [np.tile(signal, -(-count // signal.size))[:count] for signal in signals]
    for which, damage in draw(
        st.lists(st.tuples(st.integers(0, 1), st.sampled_from(DAMAGES)), max_size=3)
    ):
        with np.errstate(all="ignore"):
            signals[which] = damage(signals[which], random)
    if draw(rarely):
        signals.reverse()
    period = record.sample_period * stride
    return period * draw(st.sampled_from((1.0, 1.0, 1.0, 1e-9, 1e-3, 60.0, 1e9))), *signals


@st.composite
def broken_records(draw):
    """A broken record, on a grid or at stamps of its own, with its valve and settings."""
    period, drive, position = draw(broken_signals())
    how, valve = draw(st.sampled_from(SETTINGS)), draw(st.sampled_from(VALVES))
    driven_by = Drive.PRESSURE
    if draw(rarely):
        valve, driven_by = replace(valve, diaphragm_area=None), Drive.FORCE
    jitter = None
    if draw(st.booleans()):
        random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
        jitter = random.exponential(size=(2, drive.size)) + 1e-3
        jitter[:, random.integers(drive.size)] *= draw(st.sampled_from((1.0, 1.0, 50.0, 1e6)))
    gap = "gap of 5 s in stem_state" if draw(rarely) else ""

    def record():
        stamped = None
        if jitter is not None:
            times = np.cumsum(jitter, axis=1) * period
            signals = zip(times, (drive, position), strict=True)
            stamped = StampedRecord(*(StampedSignal(*one) for one in signals), driven_by)
        return Recording(period, drive, position, stamped=stamped, driven_by=driven_by, gap=gap)

    return record, valve, how


def outcome_of(identify):
    """What is found, or why not; any other exception, and any warning, fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return identify()
        except RefusalError as refusal:
            return refusal


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=300)
@given(case=broken_records())
def test_by_every_method(method, case):
    make, valve, how = case
    try:
        record = make()
    except ValueError:  # numbers that are no recording
        return
    found = outcome_of(lambda: METHODS[method](record, valve, how))
    event(type(found).__name__)
    if isinstance(found, Result):
        found.summary()


@st.composite
def broken_arrivals(draw):
    """Samples of both signals as topics bring them, in blocks: jittered, late, lost, not finite."""
    period, *signals = draw(broken_signals())
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    step = min(max(period, 1e-9), 1e6) * 1e9
    kinds, stamps, values = [], [], []
    for kind, signal in zip((Kind.PRESSURE, Kind.POSITION), signals, strict=True):
        at = step * (np.arange(signal.size) + draw(st.sampled_from((0.0, 0.5, -3.0, 1e4))))
        at += step * draw(st.sampled_from((0.0, 0.2, 3.0))) * random.standard_normal(signal.size)
        at += (
            step
            * draw(st.sampled_from((0, 20, 5000)))
            * (np.arange(signal.size) > random.integers(signal.size))
        )
        kept = random.random(signal.size) < draw(st.sampled_from((1.0, 1.0, 0.9, 0.1, 0.0)))
        with np.errstate(all="ignore"):
            broken = np.where(
                random.random(signal.size) < draw(st.sampled_from((0.0, 0.0, 0.01))),
                random.choice((np.nan, np.inf, 1e308), signal.size),
                signal,
            )
        stamps.append(np.clip(at, -9.2e18, 9.2e18).astype(np.int64)[kept])
        values.append(broken[kept])
        kinds.append(np.full(int(kept.sum()), kind, np.uint8))
    if len(kinds[1]):
        kinds[1][random.random(kinds[1].size) < draw(st.sampled_from((0.0, 0.0, 0.01)))] = (
            Kind.NO_POSITION
        )
    whole = Arrivals(*(np.concatenate(parts) for parts in (kinds, stamps, values)))
    order = np.argsort(whole.stamps, kind="stable")
    if draw(rarely):
        order = random.permutation(order)
    return [
        Arrivals(*(part[block] for part in whole))
        for block in np.array_split(order, draw(st.sampled_from((1, 7))))
    ]


@settings(max_examples=400)
@given(
    blocks=broken_arrivals(),
    how=st.sampled_from(SETTINGS),
    method=st.sampled_from(tuple(METHODS)),
    valve=st.sampled_from((BENCH_VALVE, Valve(diaphragm_area=0.0445))),
    window=st.sampled_from((60.0, 5.0, 1e-6)),
)
@example(blocks=[], how=SETTINGS[0], method="plant", valve=BENCH_VALVE, window=60.0)
def test_by_the_monitor_of_a_valve(blocks, how, method, valve, window):
    """What the node does with its samples: buffer, snapshot, identification, diagnosis."""
    monitor = FrictionMonitor(MonitorSettings(valve, how, method, window=window))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for block in blocks:
            monitor.buffer.add_arrivals(monitor.buffer.in_order(block))
        try:
            monitor.accept(identify_snapshot(*monitor.input()), 1)
        except RefusedRecordError as refused:
            monitor.learn(refused.numbers, 1)
            monitor.refuse(refused)
        assert monitor.diagnosis().message


@settings(max_examples=100)
@given(signals=broken_signals(), method=st.sampled_from(tuple(METHODS)), since_1970=st.booleans())
@example(signals=(1e300, np.zeros(3), np.zeros(3)), method="plant", since_1970=False)
@example(signals=(math.inf, np.zeros(3), np.zeros(3)), method="plant", since_1970=False)
def test_by_the_command(tmp_path_factory, signals, method, since_1970):
    """A table is identified, or refused on one line; its exit code says which."""
    period, drive, position = signals
    folder = tmp_path_factory.mktemp("broken")
    table, valve = folder / "record.csv", folder / "valve.yaml"
    columns = (
        1.7e9 * since_1970 + np.append(0.0, np.full(drive.size - 1, period).cumsum()),
        drive,
        position,
    )
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = ["time_s,pressure_pa,position_m", *(",".join(map(repr, row)) for row in rows)]
    table.write_text("\n".join(lines) + "\n")
    valve.write_text("diaphragm_area: 0.0445\ntravel: 0.028575\npressure_reference: 41740.0\n")
    arguments = ["identify", table, "--valve", valve, "--method", method, "--json"]
    out, err = io.StringIO(), io.StringIO()
    with warnings.catch_warnings(), redirect_stdout(out), redirect_stderr(err):
        warnings.simplefilter("error")
        code = run([str(one) for one in arguments])
    assert (code, out.getvalue().count("\n"), err.getvalue().count("\n")) in ((0, 1, 0), (2, 0, 1))
