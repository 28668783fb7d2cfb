"""Baselines of many valves: from an earlier output, or written by hand."""

import csv
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from valve_friction_ros.health import Baseline, Measured, SlidingFriction
from valve_friction_ros.health.baseline import LARGEST_SHARE
from valve_friction_ros.health.valve_numbers import COMPARED, fit_numbers
from valve_friction_ros.identification import Verdict
from valve_friction_ros.identification.units import column_suffix
from valve_friction_ros.outside_text import as_read
from valve_friction_ros.records.unreadable import cause_of

__all__ = ["Baselines", "read_baselines"]

_COULOMB, _SLIDING, _SPEED = "coulomb_friction", "sliding_friction", "sliding_speed_m_per_s"


@dataclass(frozen=True)
class Baselines:
    """Baselines by recording and by the name of the valve in it.

    One without a recording is of its valve in every recording.
    """

    by_recording: Mapping[str, Mapping[str, Baseline]]

    def of(self, recording: str) -> Mapping[str, Baseline]:
        """Return the baselines of a recording, by the names of its valves."""
        everywhere = self.by_recording.get("", {})
        return {**everywhere, **self.by_recording.get(recording, {})}

    def count(self, recordings: Iterable[str]) -> int:
        """Count the recordings that have one."""
        return sum(bool(self.of(recording)) for recording in recordings)


def _number(row: Mapping[str, str | None], column: str) -> float:
    """Return a number of a row; nan where the cell is empty or missing."""
    text = (row.get(column) or "").strip()
    try:
        return float(text) if text else math.nan
    except ValueError:
        raise ValueError(f"column {column!r}: {text!r} is not a number") from None


def _friction(row: Mapping[str, str | None], name: str) -> tuple[float, float] | None:
    """Return a friction and its half width; None where it is not known well enough."""
    value, width = _number(row, f"{name}_n"), _number(row, f"{name}_half_width_n")
    if math.isnan(width):  # exact, unless it was identified by a method without intervals
        width = math.inf if row.get(f"{name}_verdict") == Verdict.WEAK.value else 0.0
    return (value, width) if value > 0 and width <= LARGEST_SHARE * value else None


def _numbers(row: Mapping[str, str | None]) -> dict[str, Measured]:
    """Return what else a row says of its valve, where it has intervals."""
    known = {}
    for name in COMPARED:
        suffix = column_suffix(name)
        value = _number(row, f"{name}{suffix}")
        width = _number(row, f"{name}_half_width{suffix}")
        if math.isfinite(value) and width > 0:
            known[name] = Measured(value, width)
    return fit_numbers(known)


def _baseline(row: Mapping[str, str | None]) -> Baseline | None:
    """Return the baseline of a row; None where no friction is known well enough."""
    numbers = _numbers(row)
    coulomb, slid, speed = _friction(row, _COULOMB), _friction(row, _SLIDING), _number(row, _SPEED)
    sliding = SlidingFriction(*slid, speed) if slid is not None and speed > 0 else None
    if coulomb is not None:
        return Baseline(*coulomb, sliding, numbers)
    return None if sliding is None else Baseline(sliding=sliding, numbers=numbers)


def read_baselines(path: Path) -> Baselines:
    """Read the friction of healthy valves from a CSV file, as `identify-folder` writes it.

    Of its columns these count: ``recording``, ``valve``, and the frictions with their half widths;
    an empty half width stands for an exact value. The other
    parameters count where they have half widths. A friction that is not known well enough to be a
    baseline is left out, and so is a refused valve.

    Raises ValueError, one line with the file and the row, if it cannot be read.
    """
    found: dict[str, dict[str, Baseline]] = {}
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream)
            columns = set(reader.fieldnames or ())
            frictions = {f"{name}_n" for name in (_COULOMB, _SLIDING)}
            if not {"recording", "valve"} & columns or not frictions & columns:
                raise ValueError(
                    f"{path}: give a CSV file of identify-folder, or one with the columns "
                    f"recording, valve and {_COULOMB}_n"
                )
            for number, row in enumerate(reader, start=2):
                recording, valve = (as_read(row.get(key) or "") for key in ("recording", "valve"))
                try:
                    baseline = _baseline(row)
                except ValueError as error:
                    raise ValueError(f"{path}: row {number}: {error}") from None
                if baseline is None:
                    continue
                if valve in found.setdefault(recording, {}):
                    raise ValueError(
                        f"{path}: row {number}: a second baseline of {recording} {valve}"
                    )
                found[recording][valve] = baseline
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        cause = cause_of(error)
        raise ValueError(f"{path}: cannot be read: {cause}") from None
    if not found:
        raise ValueError(f"{path}: no friction in it is known well enough to be a baseline")
    return Baselines(MappingProxyType(found))
