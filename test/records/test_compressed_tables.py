# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Exports of a historian that stores a value only when it has left a dead band."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from records import assert_held, simulated

from valve_friction_ros.identification import RefusalError, identify_plant
from valve_friction_ros.identification.engine import method
from valve_friction_ros.identification.trust.uncertainty import mean_sliding_friction
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, SensorNoise, simulate
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings

BEGIN = datetime(2026, 3, 13, 7, 5)
TRAVEL = BENCH_VALVE.travel
COLUMNS = Columns(
    pressure_column="FV-7.PT",
    position_column="FV-7.ZT",
    pressure_unit="bar",
    position_unit="percent",
    time_zone="UTC",
)


def stored(values, dead_band):
    """Rows that leave the dead band, those before them, and one a minute."""
    rows = [0]
    for row in range(1, values.size):
        if abs(values[row] - values[rows[-1]]) > dead_band:
            rows += [row - 1, row]
        elif row - rows[-1] >= 600:
            rows.append(row)
    return np.unique(rows)


def slow_levels(seed):
    """Two hours of slow moves between levels, at 10 Hz."""
    generator = np.random.default_rng(seed)
    edges = np.cumsum(generator.uniform(20.0, 240.0, 80))
    places = np.repeat(generator.uniform(0.1, 0.9, 41), 2)[1:81]
    share = np.interp(np.arange(72_000) / 10, edges, places)
    return 41_740.0 + 165_100.0 * share


@pytest.fixture
def export(tmp_path):
    """Function of tag, times in s, and values in rows: a long table of both tags."""

    def export(*signals):
        rows = [
            (time, f"{tag};{(BEGIN + timedelta(seconds=float(time))).isoformat()};{value:.4f}")
            for tag, times, values in signals
            for time, value in zip(times, values, strict=True)
        ]
        path = tmp_path / "export.csv"
        path.write_text("\n".join(["tag;time;value", *(row for _, row in sorted(rows))]) + "\n")
        return path

    return export


def read(path):
    (found,) = read_recordings(path, BENCH_VALVE, ReadingOptions(COLUMNS))
    return found


def sampled(seed, noise=2e-5):
    """Pressure, bar, and stem, %, once a second, with noise; and the sliding friction, N."""
    pressure = slow_levels(seed)
    motion = simulate(BENCH_VALVE, HIGH_FRICTION, pressure, 0.1)
    record = SensorNoise(noise, 5e6 * noise, seed).applied_to(
        simulated(pressure, 0.1, HIGH_FRICTION)
    )
    truth = mean_sliding_friction(HIGH_FRICTION, motion.velocity)
    return record.pressure[::10] / 1e5, 100.0 * record.position[::10] / TRAVEL, truth


@pytest.mark.parametrize("seed", range(2))
def test_the_friction_is_found(export, seed):
    """As it is where the historian itself interpolates the stored values once a second."""
    pressure, stem, truth = sampled(seed)
    tags = [
        ("FV-7.PT", stored(pressure, 0.005), pressure),
        ("FV-7.ZT", stored(stem, 0.3), stem),
    ]
    path = export(*((tag, rows, values[rows]) for tag, rows, values in tags))
    found = read(path)
    notes = [note for note in found.notes if "is compressed" in note]
    assert [note.partition(" is")[0] for note in notes] == ["'FV-7.PT'", "'FV-7.ZT'"]
    for (_, rows, _), note in zip(tags, notes, strict=True):
        assert f"each of its {rows.size} stored values" in note
    time = np.arange(pressure.size)
    path = export(*((tag, time, np.interp(time, rows, y[rows])) for tag, rows, y in tags))
    for recorded in (found, read(path)):
        parameters = identify_plant(recorded.recording(), BENCH_VALVE).parameters
        assert_held(parameters, {"sliding_friction": truth})
        assert parameters["sliding_friction"].half_width < 0.1 * truth


def test_interpolated_values_are_held_and_widen_the_interval(export, monkeypatch):
    """By 1.96/√12 of the force in a dead band, and of the spring in that of the stem."""
    pressure, stem, truth = sampled(2, noise=6e-5)
    time, tags = np.arange(pressure.size), []
    for tag, values, band in (("FV-7.PT", pressure, 0.005), ("FV-7.ZT", stem, 0.3)):
        rows = stored(values, band)
        tags.append((tag, time, np.interp(time, rows, values[rows])))
    recording = read(export(*tags)).recording()
    result = identify_plant(recording, BENCH_VALVE)
    (note,) = (one for one in result.warnings if " on lines between stored values" in one)
    assert note.startswith("the pressure and the stem ")
    assert_held(result.parameters, {"sliding_friction": truth})
    monkeypatch.setattr(method, "archive_dead_band", lambda _: 0.0)
    plain = identify_plant(recording, BENCH_VALVE).parameters["sliding_friction"].half_width
    hidden = np.hypot(0.0445 * 500.0, 0.003 * TRAVEL * HIGH_FRICTION.spring_constant)
    found = result.parameters["sliding_friction"].half_width
    assert found == pytest.approx(np.hypot(plain, 1.96 / np.sqrt(12.0) * hidden), rel=0.1)


def test_each_value_is_held_until_the_next(export):
    pressure, stem, _ = sampled(0)
    rows = stored(stem, 0.3)
    recording = read(
        export(("FV-7.PT", np.arange(7200), pressure), ("FV-7.ZT", rows, stem[rows]))
    ).recording()
    assert not recording.gap
    assert recording.sample_period == 1.0
    time = np.rint(recording.time).astype(int)
    held = stem[rows][np.searchsorted(rows, time, side="right") - 1]
    np.testing.assert_allclose(recording.position, np.round(held, 4) / 100 * TRAVEL, rtol=1e-12)
    np.testing.assert_allclose(recording.drive, 1e5 * np.round(pressure[time], 4), rtol=1e-12)


def test_a_month_is_held_with_bounded_memory(export):
    """The stem moves once or twice a day; one value a second would be 2.7 million."""
    generator = np.random.default_rng(4)
    counts, levels = generator.integers(10, 60, 31), generator.uniform(0.0, 100.0, 32)
    begins = np.cumsum(generator.uniform(10_000, 160_000, 31)).astype(int)
    times = np.concatenate([begin + np.arange(n) for begin, n in zip(begins, counts, strict=True)])
    stem = np.concatenate([np.linspace(*levels[day : day + 2], n) for day, n in enumerate(counts)])
    moved = read(export(("FV-7.PT", times, 1.0 + stem / 200), ("FV-7.ZT", times, stem)))
    assert "is compressed" in str(moved.notes)
    assert 250_000 < len(moved.recording()) < 350_000


def outages(count, length):
    """Times at 100 Hz with outages of varied length, s."""
    time = np.arange(6000) / 100
    lost = np.zeros(time.size, dtype=bool)
    for index, begin in enumerate(np.linspace(300, 5500, count).astype(int)):
        lost[begin : begin + round(100 * length * (0.5 + index % 3))] = True
    return time[~lost]


def test_outages_of_a_fast_sensor_are_gaps(export):
    time = outages(12, 0.5)
    stem = 50.0 + 40.0 * np.sin(time)
    found = read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem)))
    assert "is compressed" not in str(found.notes)
    assert "gap of 1.2" in found.recording().gap


def test_a_slow_logger_that_loses_a_sixth_of_its_samples_is_not_compressed(export):
    """Small moves, once a second: after each outage the value is nearly the same."""
    generator = np.random.default_rng(7)
    time, kept = np.arange(5000), np.ones(5000, dtype=bool)
    for begin in np.linspace(100, 4800, 20).astype(int):
        kept[begin : begin + generator.integers(12, 70)] = False
    stem = 50.0 + 40.0 * np.sin(time / 400.0)
    tags = (("FV-7.PT", time[kept], 1.0 + stem[kept] / 200), ("FV-7.ZT", time[kept], stem[kept]))
    found = read(export(*tags))
    assert "is compressed" not in str(found.notes)
    assert "gap of" in found.recording().gap


def test_after_a_bad_value_nothing_is_known_until_the_next(export):
    """A minute of silence is left out only where the tag has said that it is not read."""
    time = np.concatenate([60.0 * minute + np.arange(5.0) for minute in range(100)])
    stem = np.concatenate([np.linspace(10 + k % 7, 10 + (k + 1) % 7, 5) for k in range(100)])
    path = export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem))
    assert read(path).recording().stamped is None
    begin = (BEGIN + timedelta(seconds=2410.0)).isoformat()
    path.write_text(path.read_text() + f"FV-7.ZT;{begin};I/O Timeout\n")
    found = read(path)
    assert "'FV-7.ZT' is compressed" in str(found.notes)
    steps = np.diff(found.recording().stamped.position.time)
    np.testing.assert_allclose(steps[np.abs(steps - 1.0) > 1e-6], 56.0)
    assert "gap of 56 s" in found.recording().gap  # it was a rest, as the stem goes on where it was


def test_bunches_are_not_compressed(export):
    """Twenty samples on arrival, every 10 s."""
    time = np.concatenate([10.0 * bunch + 0.05 * np.arange(20) for bunch in range(40)])
    stem = 50.0 + 3.0 * np.sin(0.02 * time)
    with pytest.raises(RefusalError, match=r"gap of 9\.05 s"):
        read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem))).recording()


def test_values_that_differ_after_each_pause_are_lost(export):
    """A collector that was off most of the time, while the valve moved on."""
    generator = np.random.default_rng(3)
    begins = np.cumsum(generator.uniform(100.0, 600.0, 30))
    time = np.concatenate([begin + np.arange(20.0) for begin in begins])
    stem = np.repeat(generator.uniform(0.0, 100.0, 30), 20)
    with pytest.raises(RefusalError, match="gaps take"):
        read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem))).recording()


def test_a_stem_that_stands_still_for_hours_is_silent(export):
    """Three strokes, stored at each change; the pressure is stored all the time, or not either."""
    begins = np.array([0.0, 9000.0, 20_000.0])
    time = np.concatenate([begin + np.arange(41.0) for begin in begins])
    stem = np.tile(50.0 + 20.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, 41)), 3)
    always = np.arange(20_041.0)
    within = np.interp(always, time, stem)
    for stored_pressure in ((time, 1.0 + stem / 200), (always, 1.0 + within / 200)):
        found = read(export(("FV-7.PT", *stored_pressure), ("FV-7.ZT", time, stem)))
        recording = found.recording()
        assert not recording.gap
        assert (recording.sample_period, len(recording)) == (1.0, 20_041)
        assert "'FV-7.ZT' is compressed: each of its 123 stored values" in str(found.notes)
        np.testing.assert_allclose(recording.position, within / 100 * TRAVEL, atol=3e-8)


def test_a_jump_after_a_rest_is_a_gap_unless_the_other_signal_was_there(export):
    """A stem that is scanned each 5 s jumps by a third of its range from rest to rest."""
    generator = np.random.default_rng(8)
    begins = np.cumsum(generator.uniform(600.0, 2000.0, 10)).round()
    time = np.concatenate([begin + np.arange(0.0, 100.0, 5.0) for begin in begins])
    stem = np.repeat(10.0 + 30.0 * (np.arange(10) % 3), 20)
    with pytest.raises(RefusalError, match="gap of"):
        read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem))).recording()
    always = np.arange(begins[0], time[-1] + 1.0)
    held = stem[np.searchsorted(time, always, side="right") - 1]
    recording = read(export(("FV-7.PT", always, 1.0 + held / 200), ("FV-7.ZT", time, stem)))
    assert not recording.recording().gap


def test_few_values_at_uneven_times_are_lines_and_rests(export):
    """As a swinging door stores them: both ends of each ramp and of each rest."""
    time = np.array([0, 1, 300, 301, 1500, 1800, 1801, 2500, 2501, 3400, 3700, 5000])
    stem = np.array([20, 20, 60, 60, 60.1, 30, 30, 30.1, 30, 30, 70, 70.0])
    found = read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem)))
    recording = found.recording()
    assert (recording.gap, recording.sample_period) == ("", 1.0)
    assert "is held until the next; 3 long lines are kept" in str(found.notes)
    on_lines = np.interp(recording.time, time, stem) / 100 * TRAVEL
    np.testing.assert_allclose(recording.position, on_lines, atol=0.0011 * TRAVEL)


def test_forced_values_of_a_still_stem_are_not_its_scans(export):
    """A value is stored each ten minutes in any case; the moves between are stored each 10 s."""
    begins = 600.0 * np.arange(1, 40)
    moves = [begin + 10.0 * np.arange(1, 5) for begin in begins[::6]]
    time = np.sort(np.concatenate([begins, *moves]))
    stem = 40.0 + 20.0 * np.interp(time, np.ravel(moves), np.arange(28.0) // 4 % 2)
    recording = read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem)))
    assert recording.recording().sample_period == 10.0


def test_jittering_stamps_of_a_logger_are_not_compressed(export):
    """By a third of the period; some samples come nearly together."""
    generator = np.random.default_rng(9)
    time = np.sort(np.arange(2000) + 0.33 * generator.standard_normal(2000))
    stem = 50.0 + 40.0 * np.sin(time / 100.0)
    found = read(export(("FV-7.PT", time, 1.0 + stem / 200), ("FV-7.ZT", time, stem)))
    assert "is compressed" not in str(found.notes)


def test_repeated_values_are_scanned_as_slowly_as_they_change(export, monkeypatch):
    """An export five times a second of values read once a second hides as much between them."""
    pressure, stem, _ = sampled(0)
    begin = slice(0, 2400)
    rows = np.arange(0.0, 2400.0, 0.2)
    tags = (("FV-7.PT", pressure[begin]), ("FV-7.ZT", stem[begin]))
    recording = read(export(*((tag, rows, np.repeat(y, 5)) for tag, y in tags))).recording()
    found = identify_plant(recording, BENCH_VALVE).parameters["sliding_friction"]
    monkeypatch.setattr(method, "_UNSEEN", 0.0)
    plain = identify_plant(recording, BENCH_VALVE).parameters["sliding_friction"]
    added = np.sqrt(found.half_width**2 - plain.half_width**2)
    assert added == pytest.approx(0.04 * found.value, rel=1e-6)
