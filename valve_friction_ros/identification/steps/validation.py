# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Validation: a recording simulated with an identified model, section 5 of the paper."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import UNITS, IdentificationSettings
from valve_friction_ros.identification.trust import excitation
from valve_friction_ros.model.checks import A_MODEL, A_VALVE, require_type
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.simulation import StemState, simulate
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.signals import measured

_NEEDED = ("coulomb_friction", "spring_constant")
_NAMES = tuple(field.name for field in fields(KarnoppParameters))


class IdentifiedModel(NamedTuple):
    """A model to simulate, with a sentence for each substitute of a value not identified."""

    parameters: KarnoppParameters
    notes: tuple[str, ...]


def identified_model(
    values: Mapping[str, float], known: Mapping[str, float] | None = None
) -> IdentifiedModel:
    """Build a model from identified values; substitutes replace missing values.

    Parameters
    ----------
    values : mapping of str to float
        Identified values by name; nan where a value is not identifiable.
    known : mapping of str to float, optional
        Nominal values to substitute, such as those of a valve file. Without a nominal value the
        mass is `IdentificationSettings.assumed_mass`, F_s is F_c, and F_v is 2·√(k·m), critical
        damping: the smallest F_v without oscillation.

    Returns
    -------
    IdentifiedModel
        The model and notes.

    Raises
    ------
    RefusalError
        If F_c or k is missing, or if F_0 is missing and has no nominal value.
    ValueError
        If a value is impossible; the message names it.
    """
    nominal = known or {}
    found = {name: value for name, value in values.items() if math.isfinite(value)}
    for name in _NEEDED:
        if name not in found:
            raise RefusalError(
                f"{name} was not identified, but a model needs it: identify a record that "
                "determines it"
            )
    notes = []
    if found.get("viscous_friction", 0.0) < 0:
        notes.append(f"viscous_friction is negative ({found.pop('viscous_friction'):.4g} N·s/m)")
    if "spring_preload" not in found and "spring_preload" not in nominal:
        raise RefusalError(
            "spring_preload was not identified, but a model needs it: give it in the valve file, "
            "or identify a record that determines it"
        )
    mass = found.get("mass", nominal.get("mass", IdentificationSettings().assumed_mass))
    substitutes = {
        "mass": (mass, "assumed"),
        "viscous_friction": (
            2 * math.sqrt(found["spring_constant"] * mass),
            "critical damping, the smallest value that avoids oscillation",
        ),
        "static_friction": (found["coulomb_friction"], "the coulomb_friction"),
        "spring_preload": (0.0, ""),
    }
    for name, (value, why) in substitutes.items():
        if name not in found:
            found[name] = nominal.get(name, value)
            source = "of the valve file" if name in nominal else why
            notes.append(f"{name} is not identified: {found[name]:.6g} {UNITS[name]}, {source}")
    if found["static_friction"] < found["coulomb_friction"]:
        notes.append(
            f"static_friction ({found['static_friction']:.6g} N) lies below coulomb_friction: "
            "the model takes F_s equal to F_c"
        )
        found["static_friction"] = found["coulomb_friction"]
    model = {name: value for name, value in found.items() if name in _NAMES}
    return IdentifiedModel(KarnoppParameters(**model), tuple(notes))


_START_TIME = 0.1
"""Longest part of the record, s, that gives the initial state.

Chosen: the speed changes little within it; an absolute time, half the time constant F_v/k of the
tight bench packing."""

_START_ORDER = 3
"""Polynomial order whose fitting window gives the length of that part: the paper's n."""

_MOVES = 4.0
"""Standard errors above which the first slope is a motion: 6 of 100,000 rests by chance."""


@dataclass(frozen=True, eq=False)
class Validation:
    """A measured record and the stem position simulated at the same times, m, shape (n,).

    The notes name substitutes for values that the model lacks, one sentence each.
    """

    recording: Recording
    simulated: NDArray[np.float64] = field(repr=False)
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return fit and errors on one line, and each note on its own line."""
        figures = (
            f"fit {100 * self.fit:.2f} %, rms {self.rms * 1e6:.3g} µm, "
            f"largest error {self.maximum_error * 1e6:.3g} µm"
        )
        return "\n".join([figures, *(f"note: {note}" for note in self.notes)])

    @property
    def residual(self) -> NDArray[np.float64]:
        """Simulated minus measured position, m, shape (n,)."""
        return self.simulated - self.recording.position

    @property
    def fit(self) -> float:
        """Share of the movement that is reproduced, 1 − ‖y − ŷ‖ / ‖y − ȳ‖, at most 1.

        It is 0 for the mean position in place of a model, and negative for a worse model.
        """
        position = self.recording.position
        moved = float(np.linalg.norm(position - position.mean()))
        return 1 - float(np.linalg.norm(self.residual)) / moved

    @property
    def rms(self) -> float:
        """Root mean square of the residual, m, sensor noise included."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def maximum_error(self) -> float:
        """Largest magnitude of the residual, m, sensor noise included."""
        return float(np.max(np.abs(self.residual)))


def measured_start(recording: Recording, valve: Valve) -> StemState:
    """Estimate the state of the stem at the first sample.

    A straight line through the first samples, as many as the noise requires and 0.1 s at most,
    gives position and velocity; a slope within the noise counts as rest.
    """
    record = measured(recording)
    longest = max(round(_START_TIME / recording.sample_period), 2)
    count = min(record.fitting_window(_START_ORDER), longest, len(recording))
    position = recording.position[:count]
    place = np.arange(count) - (count - 1) / 2
    spread = float(place @ place)
    slope = float(place @ position) / spread
    level = float(position.mean())
    if abs(slope) <= _MOVES * record.white_noise / np.sqrt(spread):
        slope = 0.0
    start = level + slope * place[0]
    stops = (0.0, valve.travel) if np.isfinite(valve.travel) else (-np.inf, np.inf)
    inside = float(np.clip(start, *stops))
    return StemState(inside, slope / recording.sample_period if inside == start else 0.0)


def validate(
    recording: Recording, valve: Valve, parameters: KarnoppParameters | Result
) -> Validation:
    """Simulate a recording with a model, to compare the simulated with the measured stem.

    The stem starts at the measured position and velocity (`measured_start`); nothing is fitted to
    this record. Position and velocity are the whole state of a Karnopp stem: within the dead band
    static friction holds it at the start, as in the machine. An error of the start comes from
    sensor noise only, and lasts until the stem first slides. The pressure is smoothed as for the
    identification, because its noise would break the stem away early.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position; to validate, not the record that was identified.
    valve : Valve
        Geometry.
    parameters : KarnoppParameters or Result
        The model, or a result with its identified values (`identified_model`).

    Returns
    -------
    Validation
        Simulated position, fit and errors.

    Raises
    ------
    RefusalError
        If the record has a gap, the stem did not move, or the model has no spring: the simulation
        of such a stem drifts away from the record whatever the friction.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> packing = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
    >>> time = np.arange(4000) / 100
    >>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
    >>> stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
    >>> validation = vf.validate(vf.Recording(0.01, pressure, stem.position), valve, packing)
    >>> bool(validation.fit > 0.999)
    True
    >>> print(str(validation).split(",")[0])
    fit 100.00 %
    """
    require_type("recording", recording, "what vf.read_recording returns", Recording)
    require_type("valve", valve, A_VALVE, Valve)
    require_type("parameters", parameters, A_MODEL, KarnoppParameters, Result)
    notes: tuple[str, ...] = ()
    if isinstance(parameters, Result):
        parameters, notes = identified_model(parameters.values)
    if parameters.spring_constant == 0:
        raise RefusalError(
            "a model without a spring cannot be validated: its simulated stem drifts away; use a "
            "record of a valve with a spring"
        )
    record = measured(recording)
    excitation.require_unbroken(record)
    excitation.require_motion(record, valve.travel)
    excitation.require_drive(record, valve)
    trajectory = simulate(
        valve,
        parameters,
        record.smoothed_drive,
        recording.sample_period,
        measured_start(record, valve),
    )
    return Validation(recording, trajectory.position, notes)
