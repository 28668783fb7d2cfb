# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a record shows of a valve though its friction cannot be identified."""

import contextlib
import math
from collections.abc import Mapping

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.sensor_noise import sensor_noises
from valve_friction_ros.health.stem_reach import stem_reach
from valve_friction_ros.identification import IdentificationSettings, RefusalError
from valve_friction_ros.identification.trust.excitation import (
    require_drive,
    require_motion,
    require_related_signals,
    require_travel,
    require_two_directions,
    require_within_travel,
)
from valve_friction_ros.identification.trust.plausible_units import require_plausible_units
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve


class RefusedRecordError(RefusalError):
    """A refusal, with what its record shows all the same.

    Attributes
    ----------
    numbers : mapping of str to Measured
        Numbers of the valve by name, SI units (`numbers_of_refused`).
    is_fault : bool
        Whether the record cannot be used, rather than shows too little motion.
    """

    def __init__(
        self, message: str, numbers: Mapping[str, Measured], is_fault: bool = True
    ) -> None:
        super().__init__(message)
        self.numbers, self.is_fault = numbers, is_fault

    def __reduce__(self) -> tuple[object, ...]:
        """Let it pass from process to process."""
        return type(self), (str(self), self.numbers, self.is_fault)


def numbers_of_refused(
    recording: Recording, valve: Valve, settings: IdentificationSettings
) -> dict[str, Measured]:
    """Return what a refused record shows of its valve: noise of the sensors, ends of the stem.

    Signals of an impossible size say nothing. The ends of the stem's motion are there only where
    the stem moved both ways and with the drive.
    """
    numbers: dict[str, Measured] = {}
    with contextlib.suppress(RefusalError, ValueError):
        require_drive(recording, valve)
        require_plausible_units(recording, valve, settings)
        require_within_travel(recording, valve)
        numbers |= sensor_noises(recording)
        require_motion(recording)
        require_two_directions(recording, settings.published_window, valve.travel)
        require_travel(recording, valve)
        require_related_signals(recording)
        numbers |= stem_reach(recording, valve, math.nan)
    return numbers
