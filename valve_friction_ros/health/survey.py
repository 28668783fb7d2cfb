# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The first survey of a valve: good, watch or bad by its dead band, without a baseline."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType


class Survey(Enum):
    """What a first survey says of a valve."""

    UNKNOWN = "unknown"
    """The record does not tell."""
    GOOD = "good"
    WATCH = "watch"
    BAD = "bad"


@dataclass(frozen=True)
class SurveyLimits:
    """Bounds of the dead band of actuator and valve, without a positioner.

    Attributes
    ----------
    watch, bad : float
        Dead band (F_c + F_s)/k over the travel, which is that of the actuator over its range; where
        there is no spring, twice the friction over the force of the actuator's range.

    Raises
    ------
    ValueError
        Unless 0 < watch < bad.

    Notes
    -----
    The defaults are those of ``ptfe`` in `PACKING_LIMITS`.
    """

    watch: float = 0.10
    bad: float = 0.20

    @classmethod
    def of_packing(
        cls, packing: str = "ptfe", watch: float | None = None, bad: float | None = None
    ) -> "SurveyLimits":
        """Return the limits of a class of packing; `watch` and `bad` take their place if given.

        Raises ValueError for an unknown class, or limits that are out of order.
        """
        if packing not in PACKING_LIMITS:
            raise ValueError(f"packing must be {' or '.join(PACKING_LIMITS)}, got {packing!r:.60}")
        usual = PACKING_LIMITS[packing]
        return cls(usual.watch if watch is None else watch, usual.bad if bad is None else bad)

    def __post_init__(self) -> None:
        """Refuse limits that are out of order."""
        if not 0 < self.watch < self.bad:
            raise ValueError(
                "limits must obey 0 < survey_watch < survey_bad, got "
                f"survey_watch {self.watch:g}, survey_bad {self.bad:g}"
            )


PACKING_LIMITS: Mapping[str, SurveyLimits] = MappingProxyType(
    {"ptfe": SurveyLimits(), "graphite": SurveyLimits(0.15, 0.30)}
)
"""Limits by class of packing.

They come from the packings that the paper measured on one valve: that of low friction has 5 %, that
of high friction, with which its loop oscillates, 21 %, and graphite with a slip jump 27 %. Half of
what oscillates is to be watched. Graphite may have half as much again, which is chosen."""


def surveyed(band: float, half_width: float, limits: SurveyLimits | None = None) -> Survey:
    """Return what a dead band says, a share, with half the width of its 95 % interval.

    Good and bad are said where the whole interval is; nothing where it spans from good to bad.
    """
    limits = limits or SurveyLimits()
    low, high = band - half_width, band + half_width
    if math.isnan(low) or (low < limits.watch and high >= limits.bad):
        return Survey.UNKNOWN
    if low >= limits.bad:
        return Survey.BAD
    return Survey.GOOD if high < limits.watch else Survey.WATCH
