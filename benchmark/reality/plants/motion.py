# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a valve does under a drive: exact signals on a fine grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants.kernel import GRID, SUMS, Loop, runner_of
from benchmark.reality.plants.parameters import STEPS, Plant, constants


@dataclass(frozen=True, eq=False)
class Motion:
    """True signals of a valve, `GRID` seconds apart.

    Attributes
    ----------
    begin : float
        Time of the first point, s; the record begins at 0.
    pressure : ndarray of float, shape (n,)
        Pressure where the sensor is, Pa.
    position, friction : ndarray of float, shape (n,)
        Position of the stem (m) and friction force (N, against upward motion).
    distance, work : float
        ∫|dx| (m) and ∫|F·dx| (J) of the record.
    coulomb_by_distance, coulomb_by_time : float
        F_c averaged over the distance slid and over the time of motion, N.
    largest : float
        Largest friction without its viscous part, N.
    """

    begin: float
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]
    friction: NDArray[np.float64]
    distance: float
    work: float
    coulomb_by_distance: float
    coulomb_by_time: float
    largest: float

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
    """Move a valve.

    Parameters
    ----------
    plant : Plant
        The valve.
    loop : Loop
        Converter, and controller if there is one.
    signal : ndarray of float, shape (n,)
        Command or set point, 0 to 1, at the points of the grid.
    disturbance : ndarray of float, shape (m,)
        Noise of what the controller measures, 1, at each of its actions.
    before : float
        Time between the first point and the begin of the record, s.
    step : float, optional
        Largest time step, s; by default that of the law.

    Returns
    -------
    Motion
        Pressure, position and friction at all points; the sums only of the record.
    """
    law = plant.friction.law
    substeps = int(np.ceil(GRID / (step or STEPS[law]) - 1e-9))
    outputs, sums = np.empty((3, signal.size)), np.zeros(SUMS)
    first = round(before / GRID)
    fine = GRID / substeps
    runner_of(law)(constants(plant), loop, signal, disturbance, fine, first, outputs, sums)
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
