# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the stamps and values of a record show of how it was sampled."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.signals import quantisation_step, stamped_noise, without_repeats
from valve_friction_ros.wording import percentage

_JITTER = 0.01
"""Scatter of the pauses, over the period, above which stamps are irregular."""

_IRREGULAR = 0.25
"""The same, above which a pause no longer shows whether a sample is missing."""

_DROPS = 0.005
"""Share of missing samples above which they are reported."""

_LONG = 1.5
"""Pause, over the period, from which a sample may be missing."""

_GAP = 10.0
_RATES = 1.5
_HELD = 1.5
"""Mean number of equal samples in a row, while the signal moves, above which it is held."""

_COARSE = 1.0
"""Step of a converter, over the deviation of the noise, above which the step is coarse."""

_LASTING = 0.016
"""Time, s, between samples whose noise is compared with that of neighbours."""

_COLOURED = 2.0
"""Noise, over that of neighbours, above which it is reported as lasting.

It is 1 for white noise, up to 1.5 in a benchmark's records of jerking stems, 2.6 and more where
noise has a memory of 5 ms."""

_FEWEST = 500
_SLOW = 0.02
"""Period, s, above which a slow stem may not be followed through its corners."""


def _missing_share(pauses: NDArray[np.float64]) -> float:
    """Share of the samples that are missing, from `pauses` over the period, outside gaps.

    A pause is long because of a lost sample or jitter. Jitter takes from the neighbouring pauses
    what it adds to this one, so they are counted with it.
    """
    near = pauses[pauses <= _GAP]
    long = np.convolve(near >= _LONG, np.ones(3), "same") > 0
    ordinary = near[~long] if (~long).any() else near[near < _LONG]
    missing = float(np.sum(near[long])) / float(np.mean(ordinary)) - np.count_nonzero(long)
    return max(missing, 0.0) / (near.size + 1 + max(missing, 0.0))


def _stamp_remarks(name: str, signal: StampedSignal) -> list[str]:
    pauses = np.diff(signal.time) / signal.period
    scatter = float(np.std(pauses[pauses < _LONG]))
    lost = _missing_share(pauses)
    remarks = []
    if scatter > _JITTER:
        remarks.append(f"the stamps of {name} jitter by {percentage(scatter)} of their interval")
    if lost > _DROPS and scatter < _IRREGULAR:
        remarks.append(f"{percentage(lost)} of the samples of {name} are missing")
    gaps = pauses[pauses > _GAP]
    if gaps.size:
        seconds = float(np.sum(gaps)) * signal.period
        count = "a gap" if gaps.size == 1 else f"{gaps.size} gaps"
        remarks.append(f"{count} in {name}, {seconds:.2g} s in total, left out")
    return remarks


def _value_remarks(name: str, signal: StampedSignal, size: float, unit: str) -> list[str]:
    """Return remarks on the values of a signal, in a unit with its size in SI units."""
    changes = np.flatnonzero(np.diff(signal.value))
    remarks: list[str] = []
    if changes.size < 2:
        return remarks
    runs = np.diff(changes)
    held = float(np.median(runs))
    step = quantisation_step(signal.value)
    noise = stamped_noise(signal)
    if held > _HELD:
        remarks.append(
            f"values of {name} hold for {1e3 * held * signal.period:.2g} ms: a slow source, or "
            "the dead band of a historian"
        )
    if step > _COARSE * noise:
        remarks.append(
            f"the resolution of {name} is coarse: its steps of {step / size:.3g} {unit} exceed the "
            "noise"
        )
    return remarks


def _noise_remarks(name: str, signal: StampedSignal) -> list[str]:
    remarks, noise = [], stamped_noise(signal)
    apart = int(_LASTING / signal.period)
    if apart > 1 and signal.value.size > _FEWEST * apart:
        lasting = stamped_noise(StampedSignal(signal.time[::apart], signal.value[::apart]))
        if lasting > _COLOURED * noise:
            remarks.append(
                f"the noise of {name} is not white: {lasting / noise:.2g} times as large over "
                f"{1e3 * _LASTING:g} ms as between successive samples"
            )
    return remarks


def sampling_remarks(record: StampedRecord) -> tuple[str, ...]:
    """Return a sentence for each way in which the samples differ from those of a good sensor."""
    remarks, drive = [], record.driven_by
    for name, signal, size, unit in (
        (f"the {drive.words}", record.drive, drive.size, drive.unit),
        ("the stem", record.position, 1e-6, "µm"),
    ):
        remarks += _stamp_remarks(name, signal) + _value_remarks(name, signal, size, unit)
        remarks += _noise_remarks(name, without_repeats(signal))
    periods = record.drive.period, record.position.period
    if max(periods) > _RATES * min(periods):
        remarks.append(
            f"the signals have different rates: {drive.words} {1 / periods[0]:.3g} Hz, stem "
            f"{1 / periods[1]:.3g} Hz"
        )
    if max(periods) > _SLOW:
        remarks.append(f"the sampling is slow: {1 / max(periods):.3g} Hz")
    return tuple(remarks)
