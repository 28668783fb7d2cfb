# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Simulated valves that share no code with the package."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

PRESSURE_RANGE = (41740.0, 206840.0)
"""Converter pressure at 0 % and 100 % input, Pa."""


class Law(Enum):
    """Law of the friction force as a function of the motion."""

    MOREAU = "moreau"
    """Set-valued at rest; falls from static to Coulomb friction with speed (Stribeck)."""

    KARNOPP = "karnopp"
    """Equation (2) to the letter: below the limit velocity static friction acts."""

    LATCHED = "latched"
    """Karnopp, but after breakaway the stem slides until its speed falls below the limit."""

    LUGRE = "lugre"
    """A bristle that bends before the stem slides (Canudas de Wit, 1995)."""

    MAXWELL = "maxwell"
    """Several springs in parallel that slip one after the other (Iwan; generalized Maxwell)."""


@dataclass(frozen=True)
class Trend:
    """A smooth relative change over the travel or the record."""

    change: float = 0.0  # total relative change from start to end, around the middle
    bend: float = 0.0  # curvature: parabolic part as a share of `change`, between −1 and 1


@dataclass(frozen=True)
class Friction:
    """Friction of a packing."""

    coulomb: float  # F_c, N
    static: float  # F_s, N
    viscous: float  # F_v, N·s/m
    # speed, m/s, at which the excess of F_s over F_c has fallen by a factor of e; 0: at once
    stribeck_velocity: float = 0.0
    law: Law = Law.MOREAU
    # displacement, m, over which the force builds up, for LuGre and Maxwell
    presliding: float = 0.0
    limit_velocity: float = 0.0  # DV of the two Karnopp laws, m/s
    # relative excess of F_c and F_s upward, and their relative deficit downward
    asymmetry: float = 0.0
    # change of F_c and F_s from the seat to the end of the travel
    along_travel: Trend = field(default_factory=Trend)
    # change of F_c and F_s from the first to the last second of the record
    in_record: Trend = field(default_factory=Trend)

    def scaled(self, factor: float) -> "Friction":
        """Return a packing with all its friction `factor` times as large."""
        return replace(
            self,
            coulomb=self.coulomb * factor,
            static=self.static * factor,
            viscous=self.viscous * factor,
        )


@dataclass(frozen=True)
class Body:
    """All parameters of a valve except friction."""

    # m (kg), k (N/m) at the middle of the travel, and F_0 (N)
    mass: float
    spring: float
    preload: float
    # S_a (m²) at the middle of the travel, P_ref (Pa) and nominal travel (m)
    area: float = 0.0445
    pressure_reference: float = PRESSURE_RANGE[0]
    travel: float = 0.028575
    # relative change of stiffness and of area from the seat to the end of the travel
    spring_curve: float = 0.0
    area_change: float = 0.0
    # downward force of the medium at full travel, N, and exponent of its rise with the opening
    flow_force: float = 0.0
    flow_exponent: float = 2.0
    # distances of the stops from their nominal positions, m, positive inward
    seat: float = 0.0
    top: float = 0.0
    volume_lag: float = 0.0  # first-order lag, s, from the pressure sensor to the diaphragm


@dataclass(frozen=True)
class Plant:
    """A valve: body and friction."""

    body: Body
    friction: Friction


PACKINGS: Mapping[str, Plant] = {
    "low": Plant(Body(1.542, 2.05e5, 231.65), Friction(152.7, 152.7, 4865.0)),
    "high": Plant(Body(1.75, 2.05e5, 231.65), Friction(606.0, 606.0, 4.48e4)),
    "graphite": Plant(
        Body(1.6, 2.069e5, 2571.0, pressure_reference=0.0), Friction(665.4, 942.4, 7.05e4)
    ),
}
"""The paper's bench valve with light and with strong tightening, and a graphite packing."""

STEPS = {
    Law.MOREAU: 5e-6,
    Law.KARNOPP: 5e-6,
    Law.LATCHED: 5e-6,
    Law.LUGRE: 4e-6,
    Law.MAXWELL: 2.5e-6,
}
"""Time step of each law, s."""

ELEMENTS = 6
"""Number of springs in the Maxwell law."""

_BRISTLE_DAMPING = 0.7
"""Damping ratio of stem and bristle before sliding."""


class Constants(NamedTuple):
    """A plant as plain numbers for compiled code, in SI units; see `Body` and `Friction`."""

    mass: float
    spring: float
    preload: float
    spring_curve: float
    area: float
    area_change: float
    pressure_reference: float
    flow_force: float
    flow_exponent: float
    travel: float
    lowest: float
    highest: float
    volume_lag: float
    coulomb: float
    static: float
    viscous: float
    stribeck_velocity: float
    limit_velocity: float
    asymmetry: float
    along_change: float
    along_bend: float
    record_change: float
    record_bend: float
    stiffness: float
    bristle_damping: float


def constants(plant: Plant) -> Constants:
    """Return the constants of a plant."""
    body, friction = plant.body, plant.friction
    bends = friction.law in (Law.LUGRE, Law.MAXWELL)
    stiffness = friction.static / friction.presliding if bends else 0.0
    numbers = {
        **vars(body),
        **vars(friction),
        "lowest": body.seat,
        "highest": body.travel - body.top,
        "along_change": friction.along_travel.change,
        "along_bend": friction.along_travel.bend,
        "record_change": friction.in_record.change,
        "record_bend": friction.in_record.bend,
        "stiffness": stiffness,
        "bristle_damping": 2 * _BRISTLE_DAMPING * float(np.sqrt(stiffness * body.mass)),
    }
    return Constants(**{name: numbers[name] for name in Constants._fields})


X, V, SLIDING, INNER = 0, 1, 2, 3
"""Indices in the state: position, speed, broken away, and the first internal variable."""

_State = NDArray[np.float64]


@numba.njit(inline="always")
def _way(value: float) -> float:
    return 1.0 if value > 0.0 else -1.0


@numba.njit(inline="always")
def _level(c: Constants, speed: float) -> float:
    """Return the friction, N, without its viscous part, at a speed ≥ 0 (Stribeck curve)."""
    if speed == 0.0:
        return c.static
    if c.stribeck_velocity == 0.0 or c.static == c.coulomb:
        return c.coulomb
    ratio = speed / c.stribeck_velocity
    if ratio > 6.0:
        return c.coulomb
    return c.coulomb + (c.static - c.coulomb) * math.exp(-ratio * ratio)


@numba.njit
def moreau(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step the set-valued law implicitly (Moreau, 1988), with rest at exactly zero speed."""
    impulse = c.mass * state[V] + step * pull
    way = _way(impulse)
    level = scale * (1.0 + way * c.asymmetry) * _level(c, abs(state[V]))
    if abs(impulse) <= step * level:
        state[V] = 0.0
        return impulse / step
    state[V] = (impulse - way * step * level) / (c.mass + step * c.viscous)
    return way * level + c.viscous * state[V]


@numba.njit(inline="always")
def _slide(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step a sliding stem with Coulomb and viscous friction; stop it where it would reverse."""
    way = _way(state[V]) if state[V] != 0.0 else _way(pull)
    level = scale * (1.0 + way * c.asymmetry) * c.coulomb
    before = c.mass * state[V] + step * pull
    after = (before - way * step * level) / (c.mass + step * c.viscous)
    if after * way < 0.0:
        state[V] = 0.0
        return before / step
    state[V] = after
    return way * level + c.viscous * after


@numba.njit
def karnopp(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step equation (2): below the limit velocity only static friction acts."""
    if abs(state[V]) < c.limit_velocity or state[V] == 0.0:
        way = _way(pull)
        limit = scale * (1.0 + way * c.asymmetry) * c.static
        if abs(pull) <= limit:
            state[V] = 0.0
            return pull
        state[V] += step * (pull - way * limit) / c.mass
        return way * limit
    return _slide(c, state, pull, scale, step)


@numba.njit
def latched(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step the Karnopp law with static friction only at rest and on a stem that slows down."""
    way = _way(pull)
    limit = scale * (1.0 + way * c.asymmetry) * c.static
    if state[V] == 0.0:
        if abs(pull) <= limit:
            return pull
        state[SLIDING] = 0.0
    speed = abs(state[V])
    if speed >= c.limit_velocity:
        state[SLIDING] = 1.0
    elif state[SLIDING] == 1.0 and abs(pull) <= limit:
        state[V], state[SLIDING] = 0.0, 0.0
        return pull
    return _slide(c, state, pull, scale, step)


@numba.njit
def lugre(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step a linear bristle, implicit in speed and deflection, explicit in their product."""
    speed = state[V]
    level = scale * (1.0 + _way(speed) * c.asymmetry) * _level(c, abs(speed))
    decay = c.stiffness * abs(speed) / level
    share = (c.stiffness - c.bristle_damping * decay) / (1.0 + step * decay)
    damping = share * step + c.bristle_damping + c.viscous
    held = share * state[INNER]
    after = (c.mass * speed + step * (pull - held)) / (c.mass + step * damping)
    state[INNER] = (state[INNER] + step * after) / (1.0 + step * decay)
    state[V] = after
    return held + damping * after


@numba.njit
def maxwell(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step parallel springs, each of which carries an equal share of the friction, then slips."""
    held = 0.0
    for element in range(ELEMENTS):
        held += state[INNER + element]
    after = (c.mass * state[V] + step * (pull - held)) / (c.mass + step * c.viscous)
    way = _way(after)
    share = scale * (1.0 + way * c.asymmetry) * _level(c, abs(after)) / ELEMENTS
    for element in range(ELEMENTS):
        stiffness = c.stiffness / (element + 1.0)
        force = state[INNER + element] + stiffness * step * after
        state[INNER + element] = min(max(force, -share), share)
    state[V] = after
    return held + c.viscous * after


STEPPED: Mapping[Law, Callable[..., float]] = {
    Law.MOREAU: moreau,
    Law.KARNOPP: karnopp,
    Law.LATCHED: latched,
    Law.LUGRE: lugre,
    Law.MAXWELL: maxwell,
}
"""A step of each law."""

GRID = 1e-4
"""Sample period of the simulated signals, s."""

SUMS = 6
"""Number of sums over the record: ∫|dx|, ∫|F·dx|, ∫F_c|dx|, ∫dt of motion, ∫F_c·dt of motion, and
the largest friction without its viscous part."""

_LOWEST, _HIGHEST = -0.15, 1.15
"""Limits of a controller's command."""


class Loop(NamedTuple):
    """The source of the command (0 to 1), and the converter from command to pressure."""

    closed: bool  # whether a controller sets the command; else the signal is the command
    flow: bool  # whether the controller measures the flow; else it measures the stem position
    # gain (1) and integral time (s) of the PI controller
    gain: float
    integral_time: float
    every: int  # grid points per action of the controller
    process_lag: float  # first-order lag, s, from opening to measured flow
    # pressure at command 0, and its change from command 0 to 1, Pa
    bottom: float
    span: float
    converter_lag: float  # first-order lag of the converter, s


def open_loop(bottom: float, span: float, converter_lag: float) -> Loop:
    """Return a loop without a controller: its signal is the command."""
    return Loop(False, False, 0.0, 1.0, 1000, 1.0, bottom, span, converter_lag)


@numba.njit(inline="always")
def _trend(place: float, change: float, bend: float) -> float:
    """Return a change from −½ to ½ of `change` as `place` runs from 0 to 1."""
    middle = place - 0.5
    return change * (middle + bend * (2.0 * middle * middle - 1.0 / 6.0))


@numba.njit
def stem_pull(c: Constants, position: float, pressure: float) -> float:
    """Return the net force of actuator, spring and medium on the stem, N."""
    place = position / c.travel
    area = c.area * (1.0 + c.area_change * (place - 0.5))
    curved = 0.5 * c.spring_curve * (place - 1.0)
    load = c.preload + c.spring * position * (1.0 + curved)
    flow = 0.0
    if c.flow_force != 0.0:
        flow = c.flow_force * max(place, 0.0) ** c.flow_exponent
    return area * (pressure - c.pressure_reference) - load - flow


def _advancer(advance: Callable[..., float]) -> Callable[..., float]:
    """Compile the motion between two grid points for one friction law."""

    @numba.njit(nogil=True)
    def travelled(
        c: Constants,
        state: NDArray[np.float64],
        pressures: NDArray[np.float64],
        target: float,
        shares: tuple[float, float],
        in_time: float,
        step: float,
        sums: NDArray[np.float64],
    ) -> float:
        """Advance by one point, update the sums, and return the friction at the end."""
        distance, work, by_distance, moving, by_time = 0.0, 0.0, 0.0, 0.0, 0.0
        pressure, inside = pressures[0], pressures[1]
        friction, largest = 0.0, 0.0
        for _ in range(round(GRID / step)):
            pressure += shares[0] * (target - pressure)
            inside += shares[1] * (pressure - inside)
            scale = in_time
            if c.along_change != 0.0:
                scale *= 1.0 + _trend(state[X] / c.travel, c.along_change, c.along_bend)
            friction = advance(c, state, stem_pull(c, state[X], inside), scale, step)
            after = state[X] + step * state[V]
            if after < c.lowest or after > c.highest:
                after = min(max(after, c.lowest), c.highest)
                state[V] = 0.0
                state[SLIDING] = 0.0
            moved = abs(after - state[X])
            state[X] = after
            if moved > 0.0:
                distance += moved
                work += abs(friction) * moved
                by_distance += scale * moved
                moving += step
                by_time += scale * step
                largest = max(largest, abs(friction - c.viscous * state[V]))
        pressures[0], pressures[1] = pressure, inside
        sums[0] += distance
        sums[1] += work
        sums[2] += by_distance * c.coulomb
        sums[3] += moving
        sums[4] += by_time * c.coulomb
        sums[5] = max(sums[5], largest)
        return friction

    return travelled


@numba.njit
def _controlled(loop: Loop, error: float, integral: float) -> tuple[float, float]:
    """Return command and integral of a PI controller."""
    rate = loop.gain * error / loop.integral_time
    integral = min(max(integral + rate * loop.every * GRID, _LOWEST), _HIGHEST)
    return min(max(loop.gain * error + integral, _LOWEST), _HIGHEST), integral


@numba.njit
def _seen(loop: Loop, measured: float, opening: float) -> float:
    """Return the measurement of the controller: the opening, or the flow that follows it."""
    if loop.flow:
        return measured + GRID / loop.process_lag * (opening - measured)
    return opening


@cache
def _runner(law: Law) -> Callable[..., Any]:
    """Compile the motion of a whole record for one friction law.

    Each process compiles it again: numba does not notice changes in the functions that a cached
    kernel calls, and a benchmark must not use an outdated plant.
    """
    travelled = _advancer(STEPPED[law])

    @numba.njit(nogil=True)
    def run(
        c: Constants,
        loop: Loop,
        signal: NDArray[np.float64],
        disturbance: NDArray[np.float64],
        step: float,
        first: int,
        outputs: NDArray[np.float64],
        sums: NDArray[np.float64],
    ) -> None:
        """Fill the rows of `outputs`: pressure, position and friction at each point.

        The record begins at grid point `first`; so do the sums and the trend in time.
        """
        state = np.zeros(INNER + ELEMENTS)
        command = integral = signal[0]
        pressures = np.full(2, loop.bottom + loop.span * command)
        state[X] = _balance(c, pressures[0])
        measured = state[X] / c.travel
        shares = (step / loop.converter_lag, step / c.volume_lag if c.volume_lag > 0.0 else 1.0)
        record = float(max(signal.size - first, 1))
        for point in range(signal.size):
            outputs[0, point], outputs[1, point] = pressures[0], state[X]
            measured = _seen(loop, measured, state[X] / c.travel)
            if not loop.closed:
                command = signal[point]
            elif point % loop.every == 0:
                error = signal[point] - measured - disturbance[point // loop.every]
                command, integral = _controlled(loop, error, integral)
            target = loop.bottom + loop.span * command
            place = max((point - first) / record, 0.0)
            in_time = 1.0 + _trend(place, c.record_change, c.record_bend)
            if point == first:
                sums[:] = 0.0
            outputs[2, point] = travelled(c, state, pressures, target, shares, in_time, step, sums)

    return run


@numba.njit
def _balance(c: Constants, pressure: float) -> float:
    """Return the equilibrium position, m, by bisection over the travel."""
    low, high = c.lowest, c.highest
    for _ in range(60):
        middle = 0.5 * (low + high)
        if stem_pull(c, middle, pressure) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@dataclass(frozen=True, eq=False)
class Motion:
    """True signals of a valve, `GRID` seconds apart."""

    begin: float  # time of the first point, s; the record begins at 0
    pressure: NDArray[np.float64]  # pressure at the sensor, Pa; shape (n,)
    # stem position (m) and friction force (N, positive against upward motion); shape (n,)
    position: NDArray[np.float64]
    friction: NDArray[np.float64]
    # ∫|dx| (m) and ∫|F·dx| (J) of the record
    distance: float
    work: float
    # F_c averaged over the distance slid and over the time of motion, N
    coulomb_by_distance: float
    coulomb_by_time: float
    largest: float  # largest friction without its viscous part, N

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the points, s."""
        times: NDArray[np.float64] = np.arange(self.position.size, dtype=np.float64)
        return self.begin + GRID * times


def move(
    plant: Plant,
    loop: Loop,
    signal: NDArray[np.float64],
    disturbance: NDArray[np.float64],
    before: float,
    step: float | None = None,
) -> Motion:
    """Move a valve; the sums of the motion are over the record only.

    `signal` has the command or the set point, 0 to 1, at the grid points, and `disturbance` the
    measurement noise of the controller, 1, at each of its actions. The record begins `before`
    seconds after the first point. `step` is the largest time step, s; by default that of the law.
    """
    law = plant.friction.law
    substeps = int(np.ceil(GRID / (step or STEPS[law]) - 1e-9))
    outputs, sums = np.empty((3, signal.size)), np.zeros(SUMS)
    first = round(before / GRID)
    fine = GRID / substeps
    _runner(law)(constants(plant), loop, signal, disturbance, fine, first, outputs, sums)
    distance, work, by_distance, moving, by_time, largest = (float(one) for one in sums)
    return Motion(
        begin=-before,
        pressure=outputs[0],
        position=outputs[1],
        friction=outputs[2],
        distance=distance,
        work=work,
        coulomb_by_distance=by_distance / distance if distance else plant.friction.coulomb,
        coulomb_by_time=by_time / moving if moving else plant.friction.coulomb,
        largest=largest,
    )
