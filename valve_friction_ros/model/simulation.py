# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulation of a valve with Karnopp friction, driven by pressure samples.

Equations (1) and (2), solved without discretisation: the pressure runs linearly from sample to
sample, and within each phase of the motion (rest, sliding up, sliding down, held by a travel
stop) the exact solution is stepped, with breakaway and stopping located inside the sample.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_finite, require_positive
from valve_friction_ros.model.linear_motion import Dynamics
from valve_friction_ros.model.stem_motion import advance_stem
from valve_friction_ros.model.stem_run import run_stem
from valve_friction_ros.model.valve import KarnoppParameters, Valve


@dataclass(frozen=True)
class StemState:
    """Position (m) and velocity (m/s) of the stem; a velocity of exactly zero means rest."""

    position: float
    velocity: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values that are not finite."""
        require_finite("position", self.position)
        require_finite("velocity", self.velocity)


class Trajectory(NamedTuple):
    """Simulated stem, one value per sample.

    Attributes
    ----------
    position : ndarray of float, shape (n,)
        Stem position, m.
    velocity : ndarray of float, shape (n,)
        Stem velocity, m/s; exactly zero where the stem rests.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]

    @property
    def end(self) -> StemState:
        """State after the last sample, to continue from."""
        return StemState(float(self.position[-1]), float(self.velocity[-1]))


def _dynamics(valve: Valve, parameters: KarnoppParameters) -> tuple[Dynamics, Dynamics]:
    """Return the dynamics of the upward and of the downward motion."""
    upward, downward = (
        Dynamics(
            mass=parameters.mass,
            viscous_friction=parameters.viscous_friction * (1 + viscous),
            coulomb_friction=parameters.coulomb_friction * (1 + coulomb),
            static_friction=parameters.static_friction * (1 + coulomb),
            spring_constant=parameters.spring_constant,
            limit_velocity=parameters.limit_velocity,
            travel=valve.travel,
            stribeck_velocity=parameters.stribeck_velocity,
        )
        for coulomb, viscous in (
            (parameters.coulomb_asymmetry, parameters.viscous_asymmetry),
            (-parameters.coulomb_asymmetry, -parameters.viscous_asymmetry),
        )
    )
    return upward, downward


def balanced_state(valve: Valve, parameters: KarnoppParameters, drive: float) -> StemState:
    """Return the rest, within the travel, at which the spring balances `drive` (Pa or N).

    Without a spring no position balances; the stem then rests at 0.
    """
    if parameters.spring_constant == 0:
        return StemState(0.0)
    force = valve.actuator_force(drive)
    balance = (force - parameters.spring_preload) / parameters.spring_constant
    lowest = 0.0 if np.isfinite(valve.travel) else -np.inf
    return StemState(float(np.clip(balance, lowest, valve.travel)))


def advance(
    state: StemState,
    valve: Valve,
    parameters: KarnoppParameters,
    drives: tuple[float, float],
    duration: float,
) -> StemState:
    """Advance `state` by `duration` seconds while the drive runs linearly between two values.

    Parameters
    ----------
    state : StemState
        State at the start.
    valve : Valve
        Geometry and travel stops.
    parameters : KarnoppParameters
        Mass, friction and spring during the step.
    drives : tuple of float
        Actuator pressure, Pa, or force, N, at the start and at the end of the step.
    duration : float
        Length of the step, s, above zero.

    Returns
    -------
    StemState
        State at the end.
    """
    duration = require_positive("duration", duration)
    before, after = (
        valve.actuator_force(require_finite(valve.driven_by.words, drive))
        - parameters.spring_preload
        for drive in drives
    )
    return StemState(
        *advance_stem(
            state.position,
            state.velocity,
            before,
            (after - before) / duration,
            duration,
            *_dynamics(valve, parameters),
        )
    )


def simulate(
    valve: Valve,
    parameters: KarnoppParameters,
    drive: NDArray[np.float64],
    sample_period: float,
    start: StemState | None = None,
) -> Trajectory:
    """Simulate the stem under a sampled drive, equations (1) and (2).

    Parameters
    ----------
    valve : Valve
        Geometry and travel stops.
    parameters : KarnoppParameters
        Mass, friction and spring.
    drive : ndarray of float, shape (n,)
        Actuator pressure, Pa, or force, N (`Valve.driven_by`), taken as linear between the samples.
    sample_period : float
        Time between two samples, s.
    start : StemState, optional
        State at the first sample; by default at rest in the balance of spring and actuator.

    Returns
    -------
    Trajectory
        Position and velocity at each sample, shape (n,) each.

    Raises
    ------
    ValueError
        If the drive is empty or not finite, or the period is not above zero.

    Notes
    -----
    The third line of (2) holds at the instant of breakaway: from there on the moving friction of
    the first line acts. A sliding stem comes to rest when its speed falls to the limit velocity
    DV while static friction can hold it, at the latest when its speed reaches zero.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> packing = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
    >>> time = np.arange(4000) / 100
    >>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
    >>> stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
    >>> stem.position.shape
    (4000,)
    """
    period = require_positive("sample_period", sample_period)
    samples = np.asarray(drive, dtype=np.float64)
    if samples.ndim != 1 or samples.size == 0 or not np.isfinite(samples).all():
        raise ValueError(f"{valve.driven_by.words} must be a non-empty row of finite samples")
    state = start or balanced_state(valve, parameters, float(samples[0]))
    forces = valve.actuator_force(samples) - parameters.spring_preload
    positions, velocities = np.empty_like(forces), np.empty_like(forces)
    positions[0], velocities[0] = state.position, state.velocity
    run_stem(forces, period, *_dynamics(valve, parameters), positions, velocities)
    return Trajectory(positions, velocities)


def compile_kernels() -> None:
    """Compile the simulation, or load its compiled form, before its first use.

    Takes some seconds the first time on a machine; a node does it before its first message.
    """
    valve = Valve()
    parameters = KarnoppParameters(1.0, 1.0, 1.0, 1.0, 1.0)
    simulate(valve, parameters, np.array([0.0, 2.0]), 1e-3)
    advance(StemState(0.0), valve, parameters, (0.0, 2.0), 1e-3)
