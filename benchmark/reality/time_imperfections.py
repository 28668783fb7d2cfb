"""Imperfect stamps, rates, messages and delays."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from benchmark.reality.imperfections import Imperfection, body, both, clocks, position, pressure
from benchmark.reality.stamps import Stamping

__all__ = ["time_imperfections"]

_TIME = ("stamp", "jitter", "irregular", "clock", "timing")
_LOSS = ("gap", "lost", "missing", "drop", "pause", "interrupt", "irregular")
_LATE = ("late ", "early ", "lag", "delay", "clock", "timing", "volume", "slow sensor", "damp")
_SLOW = ("rate ", "rates ", "sampling", "sampled", "coarse", "too slow", "too few samples")
_HELD = ("held", "hold ", "repeat", "stair", "stale", "dead band", *_SLOW)

_Rates = Sequence[tuple[float, float]]


def _table(kind: str, label: str, clock: Stamping, words: tuple[str, ...]) -> Imperfection:
    """Return a clock that both signals share, as the rows of a table do."""
    return Imperfection(kind, f"{label}, a table", clocks(clock), words=words)


def _topics(kind: str, label: str, clock: Stamping, words: tuple[str, ...]) -> Imperfection:
    """Return a clock of each signal's own, as two topics have."""
    return Imperfection(kind, f"{label}, topics", clocks(clock, clock), words=words)


def _jitters(held_out: bool) -> Iterator[Imperfection]:
    small, large = (0.15, 0.25) if held_out else (0.05, 0.3)
    yield _table("jitter", f"±{small:.0%}", Stamping(jitter=small), _TIME)
    yield _table("jitter", f"±{large:.0%}", Stamping(jitter=large), _TIME)
    yield _topics("jitter", f"±{large:.0%}", Stamping(jitter=large), _TIME)
    rate = 60.0 if held_out else 100.0
    clock = Stamping(rate=rate, jitter=0.3)
    yield _topics("jitter", f"±30% at {rate:g} Hz", clock, (*_TIME, *_SLOW))
    small, large = (30e-6, 120e-6) if held_out else (10e-6, 300e-6)
    label = "stamp error"
    yield _table(label, f"±{1e6 * small:g} µs", Stamping(stamp_error=small), _TIME)
    yield _topics(label, f"±{1e6 * large:g} µs", Stamping(stamp_error=large), _TIME)
    clock = Stamping(rate=rate, stamp_error=0.1 / rate)
    yield _table(label, f"±10% at {rate:g} Hz", clock, (*_TIME, *_SLOW))


def _clocks(held_out: bool) -> Iterator[Imperfection]:
    epoch = 1.76e9 + (4321.1234567 if held_out else 0.7654321)
    rate = 500.0 if held_out else 1000.0
    clock = Stamping(rate=rate, epoch=epoch, as_float=True)
    yield _table("epoch stamps", f"{rate:g} Hz", clock, _TIME)
    clock = replace(clock, jitter=0.05)
    yield _topics("epoch stamps", f"{rate:g} Hz, ±5%", clock, _TIME)
    resolution = 2e-3 if held_out else 1e-3
    clock = Stamping(rate=0.8 / resolution, jitter=0.2, resolution=resolution, epoch=epoch)
    yield _table("stamp resolution", f"{1e3 * resolution:g} ms", clock, _TIME)
    yield _topics("stamp resolution", f"{1e3 * resolution:g} ms", clock, _TIME)


def _losses(held_out: bool) -> Iterator[Imperfection]:
    few, many = (0.02, 0.12) if held_out else (0.01, 0.2)
    yield _table("drops", f"{few:.0%}", Stamping(drops=few), _LOSS)
    yield _topics("drops", f"{many:.0%}", Stamping(drops=many), _LOSS)
    if not held_out:
        yield _topics("drops", "5%", Stamping(drops=0.05), _LOSS)
        yield _table("gaps", "1 of 0.19 s", Stamping(bursts=1, burst=0.19), _LOSS)
    count, length = (5, 0.4) if held_out else (3, 0.5)
    clock = Stamping(bursts=count, burst=length)
    yield _topics("gaps", f"{count} of {length:g} s", clock, _LOSS)
    length = 1.2 if held_out else 2.0
    yield _table("gaps", f"1 of {length:g} s", Stamping(bursts=1, burst=length), _LOSS)


def _rates(held_out: bool) -> Iterator[Imperfection]:
    pairs: _Rates = ((500.0, 1000.0), (50.0, 200.0), (1000.0, 100.0))
    if held_out:
        pairs = ((1000.0, 250.0), (30.0, 120.0))
    for first, second in pairs:
        apart = clocks(Stamping(rate=first), Stamping(rate=second))
        label = f"{first:g} and {second:g} Hz"
        yield Imperfection("different rates", label, apart, words=_SLOW)
    for rate in (150.0, 30.0, 8.0) if held_out else (200.0, 100.0, 50.0, 20.0, 10.0, 5.0):
        common = clocks(Stamping(rate=rate))
        yield Imperfection("low rate", f"{rate:g} Hz", common, words=_SLOW)


def _held(held_out: bool) -> Iterator[Imperfection]:
    for hold in (0.012, 0.06) if held_out else (0.02, 0.1):
        label = f"pressure {1e3 * hold:g} ms"
        yield Imperfection("held", label, pressure(hold=hold), words=_HELD)
    for hold in (0.03,) if held_out else (0.005, 0.05):
        yield Imperfection("held", f"stem {1e3 * hold:g} ms", position(hold=hold), words=_HELD)
    for hold in (0.15,) if held_out else (0.05, 0.25):
        yield Imperfection("held", f"both {1e3 * hold:g} ms", both(hold=hold), words=_HELD)
    scan = Stamping(rate=20.0 if held_out else 50.0)
    for band in (0.002, 0.003) if held_out else (0.001, 0.005):
        sensors = replace(
            both(dead_band=band),
            pressure_stamping=scan,
            position_stamping=scan,
            together=False,
        )
        yield Imperfection("exception reporting", f"{band:.1%}", sensors, words=_HELD)


def _late(held_out: bool) -> Iterator[Imperfection]:
    for lag in (0.025, 0.06) if held_out else (0.01, 0.04):
        yield Imperfection("stem lag", f"{1e3 * lag:g} ms", position(lag=lag), words=_LATE)
    for lag in (0.03,) if held_out else (0.01, 0.05):
        yield Imperfection("pressure lag", f"{1e3 * lag:g} ms", pressure(lag=lag), words=_LATE)
    for lag in (0.025, 0.07) if held_out else (0.015, 0.05):
        change = body(volume_lag=lag)
        yield Imperfection("volume", f"{1e3 * lag:g} ms", change=change, words=_LATE)
    for offset in (0.025, -0.015) if held_out else (0.01, -0.01, 0.04):
        sensors = replace(clocks(Stamping()), position_stamping=Stamping(offset=offset))
        label = f"stem {1e3 * offset:+g} ms"
        yield Imperfection("clock offset", label, sensors, words=_LATE)


def time_imperfections(held_out: bool) -> Iterator[Imperfection]:
    """Yield the imperfections of time."""
    yield from _jitters(held_out)
    yield from _clocks(held_out)
    yield from _losses(held_out)
    yield from _rates(held_out)
    yield from _held(held_out)
    yield from _late(held_out)
