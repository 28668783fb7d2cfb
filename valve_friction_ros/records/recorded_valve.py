# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The recording of one valve from a file, and the part of the file to read."""

import math
from dataclasses import dataclass, field
from pathlib import Path

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.streams.samples import nanoseconds

WITHOUT_GAP = "use a stretch without it (--begin, --end)"
"""What to do about a gap in a file."""


@dataclass(frozen=True, eq=False)
class RecordedValve:
    """The recording of one valve in the file or folder `path`, or the reason why there is none.

    Attributes
    ----------
    name : str
        Namespace of the valve in a bag; empty for a file that does not name its valve.
    outcome : Recording or RefusalError
        The recording, or its refusal.
    notes : tuple of str
        Limitations of the recording: omitted samples, and the reason.
    """

    path: Path
    name: str
    outcome: Recording | RefusalError = field(repr=False)
    notes: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Name of the recording in messages."""
        return f"{self.path}, {self.name}" if self.name else f"{self.path}"

    def recording(self) -> Recording:
        """Return the recording.

        Raises RefusalError, with file, valve, cause and notes, if the valve has no recording.
        """
        if isinstance(self.outcome, RefusalError):
            raise self.refused(self.outcome)
        return self.outcome

    def refused(self, cause: RefusalError) -> RefusalError:
        """Return a refusal with file, valve and notes, which may contain the reason."""
        return RefusalError("; ".join((f"{self.label}: {cause}", *self.notes)))


@dataclass(frozen=True)
class Stretch:
    """A part of a recording; by default the whole recording.

    Attributes
    ----------
    begin, end : float
        Times since the first sample of the file, s; both belong to the stretch.
    last : float
        Length of the final part to read, s. A recording that ends at an identification of a node,
        read with the `window` of this node, equals its buffer.

    Raises
    ------
    ValueError
        If a time is not a number, or the stretch is empty.
    """

    begin: float = -math.inf
    end: float = math.inf
    last: float = math.inf

    def __post_init__(self) -> None:
        if not self.begin < self.end:
            raise ValueError(f"a stretch cannot begin at {self.begin:g} s and end at {self.end:g}")
        if not self.last > 0:
            raise ValueError(f"the last seconds must be above zero, got {self.last:g}")

    def contains(self, since_first: int) -> bool:
        """Return whether a time since the first sample, ns, lies between begin and end."""
        begin, end = (
            nanoseconds(one) if math.isfinite(one) else one for one in (self.begin, self.end)
        )
        return begin <= since_first <= end
