"""Streams of command, pressure and stem, handed to a monitor as they would arrive."""

import numpy as np

from valve_friction_ros.streams import Arrivals, Kind, Samples

START = 1_700_000_000_000_000_000
TRAVEL = 0.028575


def stamps(times):
    return START + np.round(np.asarray(times) * 1e9).astype(np.int64)


def feed(monitor, command, stem, pressure, every=0.5):
    """Hand on pairs of times (s) and values (share of the travel, Pa), `every` s at a time."""
    kinds = [(Kind.POSITION, stem, TRAVEL), (Kind.PRESSURE, pressure, 1.0)]
    at = np.concatenate([stamps(times) for _, (times, _), _ in kinds])
    of = np.concatenate([np.full(len(times), kind, np.uint8) for kind, (times, _), _ in kinds])
    values = np.concatenate([scale * np.asarray(each) for _, (_, each), scale in kinds])
    order = np.argsort(at, kind="stable")
    told, given = stamps(command[0]), TRAVEL * np.asarray(command[1])
    edges = np.arange(at.min(), at.max() + every * 2e9, round(every * 1e9))
    cuts = np.searchsorted(at[order], edges), np.searchsorted(told, edges)
    for a, b, c, d in zip(cuts[0][:-1], cuts[0][1:], cuts[1][:-1], cuts[1][1:], strict=True):
        part = order[a:b]
        monitor.take(Samples(told[c:d], given[c:d]), Arrivals(of[part], at[part], values[part]))


def held(schedule):
    """Return the times and values of a command that is published only when it changes."""
    times = np.cumsum([0.0, *(seconds for seconds, _ in schedule[:-1])])
    return times, np.array([value for _, value in schedule])


def value_at(command, times):
    return command[1][np.searchsorted(command[0], times, side="right") - 1]
