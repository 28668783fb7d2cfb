"""Signals whose source is slower than their messages: each value is repeated until the next."""

import numpy as np

from valve_friction_ros.model.stamped import StampedSignal

__all__ = ["without_repeats"]

_FEWEST = 20
_SHORTER = 0.6
_FEW = 0.02
"""A signal is held if it changes so often, and at most so many of its runs of equal values are
shorter than this share of the usual one: noise changes a signal at any time."""

_LARGER = 1.5
_MANY = 0.2
"""And if so many of its changes are larger than the least one by this factor: the values of a
converter that follows a slow stem change by one step each, at any time."""


def without_repeats(signal: StampedSignal) -> StampedSignal:
    """Keep the fresh values of a held signal, at the stamps at which they first appeared.

    A repeated value says nothing new, and a wrong thing of the time at which it is repeated. A
    signal that is not held is returned as it is. Where a source sent the same value again, the
    sample in its place is kept.
    """
    steps = np.diff(signal.value)
    changes = np.flatnonzero(steps) + 1
    if changes.size < _FEWEST:
        return signal
    runs, jumps = np.diff(changes), np.abs(steps[changes - 1])
    shortest = float(np.quantile(runs, 2 * _FEW))
    hold = float(np.median(runs[runs < 2 * shortest]))
    is_steady = np.mean(runs < _SHORTER * hold) < _FEW
    is_free = np.mean(jumps > _LARGER * jumps.min()) > _MANY
    if hold < 2 or not (is_steady and is_free):
        return signal
    sent = np.maximum(np.rint(runs / hold), 1.0).astype(np.intp)
    again = np.arange(sent.sum()) - np.repeat(np.cumsum(sent) - sent, sent)
    fresh = np.repeat(changes[:-1], sent) + np.rint(again * np.repeat(runs / sent, sent)).astype(
        np.intp
    )
    fresh = np.append(fresh, changes[-1])
    if fresh.size < StampedSignal.FEWEST:
        return signal
    return StampedSignal(signal.time[fresh], signal.value[fresh])
