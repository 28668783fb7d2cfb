"""Valves that are not quite Karnopp, drifting sensors, and coarse ones."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from benchmark.reality.excitations import Kind
from benchmark.reality.imperfections import (
    DRIVES,
    Imperfection,
    body,
    both,
    clocks,
    friction,
    position,
    pressure,
)
from benchmark.reality.plants import Law, Plant, Trend
from benchmark.reality.plants.parameters import PRESSURE_RANGE
from benchmark.reality.stamps import Stamping

__all__ = ["plant_imperfections"]

_PRESLIDING = ("presliding", "bristle", "creep", "elastic", "lugre", "before it slides", "bends")
_SLIP = ("stick", "slips", "slip jump of", "stribeck", "falls with", "falling", "jumps")
_ZONE = (*_SLIP, "dead zone", "limit velocity", "limit_velocity", "limit speed")
_ALONG = ("along the travel", "along its travel", "over the travel", "with the travel")
_DURING = ("during", "drift", "within the record", "in the record", "over the record", "trend")
_ASYMMETRIC = ("asymmetr", "upward", "up and down", "than down", "than up", "way up", "way down")
_SPRING = (*_ALONG, "curve", "curvature", "spring is", "spring force", "stiff", "area", "flow")
_STOPS = ("stop", "seat")
_DRIFT = ("drift", "zero of", "zero point", "trend")
_NOISE = ("noisy", "sensor noise", "noise of", "bits", "resolution", "quanti", "coarse")


def _laws(held_out: bool) -> Iterator[Imperfection]:
    for law in (Law.KARNOPP, Law.LATCHED):
        for speed in (0.35e-3, 0.8e-3) if held_out else (0.2e-3, 0.5e-3, 1e-3):
            change = friction(law=law, limit_velocity=speed)
            label = f"{1e3 * speed:g} mm/s, {law.value}"
            yield Imperfection("dead zone", label, change=change, words=_ZONE)
    fall = 0.8e-3 if held_out else 0.5e-3
    lugre = (10e-6, 40e-6) if held_out else (5e-6, 20e-6, 60e-6)
    maxwell = (35e-6,) if held_out else (20e-6, 60e-6)
    for law, lengths in ((Law.LUGRE, lugre), (Law.MAXWELL, maxwell)):
        for length in lengths:
            change = friction(law=law, presliding=length, stribeck_velocity=fall)
            label = f"{1e6 * length:g} µm, {law.value}"
            yield Imperfection("presliding", label, change=change, words=_PRESLIDING)


def _falling(ratio: float, speed: float) -> Callable[[Plant], Plant]:
    """Return the change to a friction that falls from `ratio` times F_c."""

    def changed(plant: Plant) -> Plant:
        static = ratio * plant.friction.coulomb
        return friction(static=static, stribeck_velocity=speed)(plant)

    return changed


def _slips(held_out: bool) -> Iterator[Imperfection]:
    for ratio, speed in (
        ((1.2, 1.2e-3), (1.35, 2e-3)) if held_out else ((1.1, 0.5e-3), (1.25, 3.26e-3))
    ):
        yield Imperfection(
            "falling with speed",
            f"×{ratio:g} to {1e3 * speed:g} mm/s",
            change=_falling(ratio, speed),
            words=_SLIP,
            is_another_plant=True,
        )
    for ratio, speed in (
        ((1.75, 0.6e-3), (1.6, 1.5e-3), (1.9, 0.4e-3))
        if held_out
        else ((1.75, 1e-3), (2.0, 3.26e-3), (2.0, 0.3e-3))
    ):
        yield Imperfection(
            "stick-slip",
            f"×{ratio:g} to {1e3 * speed:g} mm/s",
            change=_falling(ratio, speed),
            words=_SLIP,
            drives=(*DRIVES, Kind.HUNTING),
            is_another_plant=True,
        )


def _trends(held_out: bool) -> Iterator[Imperfection]:
    for trend in (Trend(-0.08, 0.5), Trend(0.15)) if held_out else (Trend(0.05), Trend(-0.1)):
        change = friction(along_travel=trend)
        label = f"{trend.change:+.0%}"
        yield Imperfection("along travel", label, change=change, words=(*_ALONG, *_SPRING))
    for trend in (Trend(-0.1, -0.6), Trend(0.07)) if held_out else (Trend(0.05), Trend(0.15)):
        change = friction(in_record=trend)
        yield Imperfection("in record", f"{trend.change:+.0%}", change=change, words=_DURING)
    for share in (0.08, -0.04) if held_out else (0.05, -0.1):
        change = friction(asymmetry=share)
        yield Imperfection("asymmetric", f"{share:+.0%}", change=change, words=_ASYMMETRIC)


def _bodies(held_out: bool) -> Iterator[Imperfection]:
    for share in (0.02, -0.04) if held_out else (0.01, 0.03, -0.06):
        change = body(spring_curve=share)
        yield Imperfection("curved spring", f"{share:+.0%}", change=change, words=_SPRING)
    for share in (-0.02,) if held_out else (-0.01, -0.03):
        change = body(area_change=share)
        yield Imperfection("area along travel", f"{share:+.0%}", change=change, words=_SPRING)
    for force, power in ((120.0, 3.0),) if held_out else ((50.0, 2.0), (250.0, 2.0)):
        change = body(flow_force=force, flow_exponent=power)
        yield Imperfection("flow force", f"{force:g} N", change=change, words=_SPRING)


def _stops(held_out: bool) -> Iterator[Imperfection]:
    seats = (0.2e-3, -0.3e-3) if held_out else (0.0, 0.3e-3)
    shifts = [(f"seat {1e3 * seat:g} mm off", body(seat=seat)) for seat in seats]
    top = 0.8e-3 if held_out else 0.5e-3
    shifts.append((f"top {1e3 * top:g} mm off", body(top=top)))
    for label, change in shifts:
        yield Imperfection("stops", label, change=change, words=_STOPS, reaches_stops=True)


def _sensors(held_out: bool) -> Iterator[Imperfection]:
    span = PRESSURE_RANGE[1] - PRESSURE_RANGE[0]
    for share in (-0.0015,) if held_out else (0.001, 0.002):
        sensors = pressure(drift=share * span / 60.0)
        yield Imperfection("zero drift", f"{share:+.2%}/min", sensors, words=_DRIFT)
    for bits in (11, 9) if held_out else (12, 10, 8):
        yield Imperfection("quantised", f"{bits} bits", both(bits=bits), words=_NOISE)
    for colour in (0.02,) if held_out else (0.005, 0.05):
        sensors = both(colour=colour)
        yield Imperfection("coloured noise", f"{1e3 * colour:g} ms", sensors, words=_NOISE)
    for stem, at_actuator in ((45e-6, 300.0),) if held_out else ((28.6e-6, 165.0), (60e-6, 400.0)):
        sensors = replace(position(noise=stem), pressure=pressure(noise=at_actuator).pressure)
        yield Imperfection("noise", f"{1e6 * stem:g} µm", sensors, words=_NOISE)


def _field(held_out: bool) -> Imperfection:
    """Return an ordinary valve with ordinary instruments: a bit of everything."""
    sign = -1.0 if held_out else 1.0

    def changed(plant: Plant) -> Plant:
        one = body(spring_curve=0.01 * sign, flow_force=30.0, volume_lag=0.01)(plant)
        return friction(
            law=Law.LUGRE,
            presliding=15e-6,
            stribeck_velocity=2e-3,
            asymmetry=-0.03 * sign,
            along_travel=Trend(0.05 * sign),
        )(one)

    clock = Stamping(rate=50.0 if held_out else 100.0, jitter=0.2, drops=0.02)
    sensors = replace(
        clocks(clock, clock),
        pressure=pressure(bits=12, noise=200.0).pressure,
        position=position(bits=12, noise=20e-6, lag=0.02 if held_out else 0.01).position,
    )
    words = (*_PRESLIDING, *_SLIP, *_SPRING, *_ASYMMETRIC, "lag", "late", "delay", "timing")
    return Imperfection("field", "a bit of everything", sensors, changed, words)


def plant_imperfections(held_out: bool) -> Iterator[Imperfection]:
    """Yield the imperfections of valve and sensors."""
    yield from _laws(held_out)
    yield from _slips(held_out)
    yield from _trends(held_out)
    yield from _bodies(held_out)
    yield from _stops(held_out)
    yield from _sensors(held_out)
    yield _field(held_out)
