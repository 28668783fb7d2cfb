"""Two stamped signals of any rates on one uniform time grid."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from valve_friction_ros.identification.refusal import LittleMotionError, RefusalError
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.stamped import StampedRecord, StampedSignal
from valve_friction_ros.streams.samples import Samples

__all__ = ["Gap", "uniform_recording"]

_LARGEST_GAP = 10
"""Sampling periods of a signal above which a pause is a gap; shorter pauses are interpolated.

Chosen: at 100 Hz or faster such a pause is 0.1 s at most, short against a stroke."""

_MOST_MISSING = 0.5
"""Share of a signal's time in gaps above which no record is built.

More than half of the grid would be interpolated, and the noise, a median, would be zero."""

_ON_GRID = 1e-3
"""Distance of a stamp from the grid, as a share of its period, up to which the stamp is on it.

Chosen: at 1 kHz that is 1 µs, in which a stem at 0.1 m/s moves by 0.1 µm, below any noise."""


@dataclass(frozen=True)
class Gap:
    """The longest gap of signal `name`: `seconds` before `sample`, `since_start` s after the first.

    All its gaps take a `share` of its time. As text it is a refusal with its remedy.
    """

    name: str
    sample: int
    seconds: float
    since_start: float
    share: float

    @property
    def what(self) -> str:
        """The refusal without its remedy."""
        return (
            f"gap of {self.seconds:.3g} s in {self.name}, {self.since_start:.3f} s after its "
            "first sample"
        )

    def __str__(self) -> str:
        """Return the refusal."""
        return f"{self.what}: use a record without a gap, or clear the buffer and record again"


def _gap(name: str, samples: Samples, period: int) -> Gap | None:
    """Return the longest gap of a signal, if it has one."""
    pauses = np.diff(samples.stamps)
    longest = int(np.argmax(pauses))
    if pauses[longest] <= _LARGEST_GAP * period:
        return None
    since_start = float(samples.stamps[longest] - samples.stamps[0]) / 1e9
    share = float(np.sum(pauses[pauses > _LARGEST_GAP * period]) / np.sum(pauses))
    return Gap(name, longest + 1, float(pauses[longest]) / 1e9, since_start, share)


def _period(name: str, samples: Samples) -> int:
    """Return the median sampling period in ns; refuse a signal that is empty."""
    if samples.stamps.size == 0:
        raise LittleMotionError(
            f"no samples of {name}: check that it is published, and on this topic"
        )
    if samples.stamps.size == 1:
        raise LittleMotionError(f"only one sample of {name}: check that it is sampled continuously")
    return int(np.median(np.diff(samples.stamps)))


def uniform_recording(
    drive: Samples,
    position: Samples,
    names: tuple[str, str] = ("actuator_pressure", "stem_state"),
    driven_by: Drive = Drive.PRESSURE,
    refusal_of: Callable[[Gap], str] = str,
) -> Recording:
    """Put drive and stem position on the time grid of the stem position.

    The grid starts at the first position inside the time that both signals cover and runs at
    the median period of the positions; both signals are interpolated linearly. Where
    the positions are uniform already, their values stay unchanged to the last bit, and so do those
    of the drive where it shares their stamps.

    Parameters
    ----------
    drive : Samples
        Actuator pressure, Pa, or force, N.
    position : Samples
        Stem position, m.
    names : tuple of str
        Names of the two signals in a refusal.
    driven_by : Drive
        What `drive` is.
    refusal_of : callable
        Puts a gap into words.

    Returns
    -------
    Recording
        Its `start_time` is the stamp of its first sample, s; `stamped` holds the samples where
        their stamps are not the grid. `gap` names the longest pause of more than ten periods.

    Raises
    ------
    RefusalError
        If a signal is empty or beyond any sensor, gaps take more than half of its time, or the two
        do not overlap.
    """
    period_of_drive = _period(names[0], drive)
    period = _period(names[1], position)
    either = _gap(names[0], drive, period_of_drive), _gap(names[1], position, period)
    gaps = [gap for gap in either if gap is not None]
    if gaps and (most := max(gaps, key=lambda gap: gap.share)).share > _MOST_MISSING:
        raise RefusalError(refusal_of(most))
    begin = max(drive.stamps[0], position.stamps[0])
    end = min(drive.stamps[-1], position.stamps[-1])
    inside = position.stamps[(position.stamps >= begin) & (position.stamps <= end)]
    if inside.size < 2:
        apart = (position.stamps[0] - drive.stamps[0]) / 1e9
        raise RefusalError(
            f"{names[0]} and {names[1]} do not overlap in time ({names[1]} begins {apart:.3g} s "
            "later): check that their clocks agree and that both are recorded"
        )
    origin = inside[0]
    grid = np.arange(0, inside[-1] - origin + 1, period, dtype=np.float64)
    on_grid = [
        np.interp(grid, (signal.stamps - origin).astype(np.float64), signal.values)
        for signal in (drive, position)
    ]
    try:
        return Recording(
            period / 1e9,
            on_grid[0],
            on_grid[1],
            start_time=float(origin) / 1e9,
            stamped=_at_own_stamps(drive, position, int(origin), period, driven_by),
            driven_by=driven_by,
            gap=refusal_of(gaps[0]) if gaps else "",
        )
    except ValueError as error:
        raise RefusalError(f"{error}: check sensor and unit") from None


def _at_own_stamps(
    drive: Samples, position: Samples, origin: int, period: int, driven_by: Drive
) -> StampedRecord | None:
    """Return both signals at their own stamps; None where these are the grid, or too few."""
    signals = drive, position
    if min(samples.stamps.size for samples in signals) < StampedSignal.FEWEST:
        return None
    same_size = drive.stamps.size == position.stamps.size
    if same_size and all(_is_on_grid(samples, origin, period) for samples in signals):
        return None
    own = (
        StampedSignal((samples.stamps - origin).astype(np.float64) / 1e9, samples.values)
        for samples in signals
    )
    return StampedRecord(next(own), next(own), driven_by)


def _is_on_grid(samples: Samples, origin: int, period: int) -> bool:
    """Return whether every stamp is on the grid, and no sample is missing."""
    since = samples.stamps - origin
    off = np.abs(since - np.rint(since / period) * period)
    return bool(np.max(off) <= _ON_GRID * period and np.max(np.diff(samples.stamps)) < 1.5 * period)
