# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Functions of the public interface that combine several packages."""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits
from valve_friction_ros.health.valve_diagnosis import diagnose_valve
from valve_friction_ros.identification.result import Result
from valve_friction_ros.model.checks import A_MODEL, A_VALVE, require_type
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording, require_row
from valve_friction_ros.model.simulation import StemState, Trajectory
from valve_friction_ros.model.simulation import simulate as simulated
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.streams.samples import Samples, uniform_recording


def read_recording(
    source: str | PathLike[str] | Mapping[str, Any],
    valve: Valve | None = None,
    name: str | None = None,
    options: ReadingOptions | None = None,
) -> Recording:
    """Read a recording from a CSV file, a bag, a pandas frame, or arrays.

    Parameters
    ----------
    source : path, or mapping of str to array_like
        CSV file (may be gzipped) or bag (MCAP or SQLite3, folder or file); or a pandas frame or
        a mapping with the columns ``time_s``, ``position_m`` and ``pressure_pa``, or ``force_n``
        for a machine without a diaphragm (`Valve()`). ``time_s`` may hold dates; the index of a
        frame may hold them instead. Dates without a zone are UTC.
    valve : Valve, optional
        Gives the range of the pressure sensor, and the travel for positions in percent. A diaphragm
        converts ``force_n`` of a file into the pressure that exerts this force.
    name : str, optional
        Namespace of the valve in a bag; required for a bag of several valves.
    options : ReadingOptions, optional
        Columns, units and layout of a CSV file, topics of a bag, and the part to read.

    Returns
    -------
    Recording
        Pressure or force, and stem position, on a common uniform time grid.

    Raises
    ------
    ValueError
        If the source cannot be read, a column is missing, or the bag does not contain the valve.
    RefusalError
        If the samples do not form a record. A gap is allowed: see `Recording.gap`.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> columns = {
    ...     "time_s": [0.0, 0.1, 0.2], "pressure_pa": [1e5, 1.1e5, 1.2e5],
    ...     "position_m": [0.0, 0.0, 1e-4],
    ... }
    >>> recording = vf.read_recording(columns)
    >>> len(recording), recording.sample_period
    (3, 0.1)
    """
    if not isinstance(source, (str, PathLike)):
        return _from_columns(source)
    recorded = read_recordings(Path(source), valve or Valve(), options)
    names = ", ".join(each.name for each in recorded)
    if name is None and len(recorded) > 1:
        raise ValueError(f"{source}: several valves ({names}): choose one with name=")
    for each in recorded:
        if name is None or each.name.strip("/") == name.strip("/"):
            return each.recording()
    raise ValueError(f"{source}: no valve is named {name!r}; choose from {names}")


def _column(columns: Mapping[str, Any], name: str) -> NDArray[np.float64]:
    """Return a column as finite numbers; raises ValueError with its name if that fails."""
    return require_row(name, columns[name])


def _require_names(columns: Mapping[str, Any], names: Sequence[str]) -> None:
    """Refuse columns without some of the names; dates in the index stand in for the first."""
    index = getattr(getattr(columns, "index", None), "dtype", None)
    dated = names[:1] if getattr(index, "kind", "") in ("M", "m") else ()
    lacking = [one for one in names if one not in columns and one not in dated]
    if lacking:
        there = [str(one)[:40] for one in getattr(columns, "columns", columns)]
        known = ", ".join(there[:_MOST_NAMES]) + " …" * (len(there) > _MOST_NAMES)
        raise ValueError(
            f"there is no column {' and no column '.join(map(repr, lacking))} among "
            f"{known or 'none'}: rename columns, in s, m, and Pa or N (force_n); write other units "
            "to a file, whose headers may state them"
        )


_MOST_NAMES = 12
"""Names of columns in a message."""

_LATEST = 2**63 / 1e9
"""Seconds since 1970 beyond which nanoseconds do not fit into 64 bits, in the year 2262."""


def _stamps(columns: Mapping[str, Any]) -> NDArray[np.int64]:
    """Return ``time_s``, or the dates in a frame's index, as ns; dates count from 1970."""
    given: Any = columns["time_s"] if "time_s" in columns else getattr(columns, "index", None)
    dtype = getattr(given, "dtype", None)
    if getattr(dtype, "kind", "") == "M" and hasattr(given, "to_numpy"):  # pandas, or its Arrow
        dates = getattr(given, "to_series", lambda: given)().dt
        if dates.tz is not None:
            given = dates.tz_convert("UTC").to_numpy("datetime64[ns]")
    kind = np.asarray(given).dtype.kind
    if kind in "Mm" and not isinstance(given, np.ma.MaskedArray):
        dated = np.asarray(given, f"{kind}8[ns]")
        if np.isnat(dated).any():
            raise ValueError(f"time_s has no date at sample {int(np.argmax(np.isnat(dated)))}")
        return dated.astype(np.int64)
    seconds = _column(columns, "time_s")
    if np.abs(seconds).max() >= _LATEST:
        raise ValueError(
            f"time_s reaches {np.abs(seconds).max():.3g} s, which is after the year 2262: give "
            "seconds, or dates"
        )
    return np.rint(seconds * 1e9).astype(np.int64)


def _from_columns(columns: Mapping[str, Any]) -> Recording:
    if isinstance(columns, (Sequence, np.ndarray)) or not hasattr(columns, "__contains__"):
        raise TypeError(
            "source must be a path, a frame or a mapping of columns, got "
            f"{type(columns).__name__}; for a file per signal give one of the paths, and the "
            "others as ReadingOptions(beside=...)"
        )
    is_force = "force_n" in columns and "pressure_pa" not in columns
    names = ("force_n" if is_force else "pressure_pa", "position_m")
    _require_names(columns, ("time_s", *names))
    stamps = _stamps(columns)
    drive, position = (_column(columns, name) for name in names)
    if not stamps.size == drive.size == position.size:
        raise ValueError(
            f"time_s has {stamps.size} samples, {names[0]} {drive.size}, {names[1]} {position.size}"
        )
    later = np.diff(stamps) > 0
    if not later.all():
        sample = int(np.argmin(later)) + 1
        raise ValueError(f"time_s does not increase at sample {sample}: sort the rows")
    driven_by = Drive.FORCE if is_force else Drive.PRESSURE
    return uniform_recording(Samples(stamps, drive), Samples(stamps, position), names, driven_by)


def simulate(
    valve: Valve,
    parameters: KarnoppParameters | Result,
    drive: NDArray[np.float64],
    sample_period: float,
    start: StemState | None = None,
) -> Trajectory:
    """Simulate the stem for a sampled drive, equations (1) and (2).

    Parameters
    ----------
    valve : Valve
        Geometry and travel stops.
    parameters : KarnoppParameters or Result
        The model, or a result that contains a model.
    drive : ndarray of float, shape (n,)
        Actuator pressure, Pa, or force, N.
    sample_period : float
        Time between two samples, s.
    start : StemState, optional
        State at the first sample; by default at rest in the balance of forces.

    Returns
    -------
    Trajectory
        Position and velocity of the stem.

    Raises
    ------
    RefusalError
        If a result has no model.
    ValueError
        If the drive or the sampling period is impossible.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> packing = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
    >>> pressure = np.linspace(1e4, 1e5, 1000)
    >>> stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
    >>> round(1e3 * float(stem.position[-1]), 1)
    20.9
    """
    require_type("valve", valve, A_VALVE, Valve)
    require_type("parameters", parameters, A_MODEL, KarnoppParameters, Result)
    if isinstance(parameters, Result):
        parameters = parameters.simulated_model()
    return simulated(valve, parameters, drive, sample_period, start)


def compare(
    result: Result, baseline: Baseline | Result, limits: FrictionLimits | None = None
) -> Diagnosis:
    """Compare identified friction with the friction of the healthy valve.

    Parameters
    ----------
    result : Result
        The present friction.
    baseline : Baseline or Result
        Friction of the healthy valve: a number with its half width, or an identification.
    limits : FrictionLimits, optional
        Ratios that define grown, excessive and collapsed friction.

    Returns
    -------
    Diagnosis
        Level, NE 107 status signal, message, and ratio with its interval.

    Raises
    ------
    RefusalError
        If `baseline` is a result whose Coulomb friction is not identifiable or not above zero.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> time = np.arange(4000) / 100
    >>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
    >>> def identified(friction):
    ...     parameters = vf.KarnoppParameters(1.6, 4865.0, friction, friction, 2.05e5)
    ...     stem = vf.simulate(valve, parameters, pressure, 0.01)
    ...     return vf.identify(vf.Recording(0.01, pressure, stem.position), valve)
    >>> diagnosis = vf.compare(identified(400.0), identified(150.0))
    >>> diagnosis.level.name, round(diagnosis.ratio.value, 1)
    ('ERROR', 2.7)
    """
    require_type("result", result, "what vf.identify returns", Result)
    require_type("baseline", baseline, "a result, or vf.Baseline(friction in N)", Baseline, Result)
    healthy = Baseline.of(baseline) if isinstance(baseline, Result) else baseline
    return diagnose_valve(result, healthy, limits).friction
