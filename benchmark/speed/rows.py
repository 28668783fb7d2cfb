# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One measured item beside its peer, and how to measure."""

import resource
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

__all__ = ["Row", "Settings", "medians"]


def _say_nothing(_: str) -> None:
    pass


@dataclass(frozen=True)
class Settings:
    """How thoroughly the parts measure.

    Attributes
    ----------
    repeats : int
        Repetitions of each measurement, of which the median counts.
    seconds : float
        How long each stream runs, s.
    say : callable
        Shows what is being done now.
    """

    repeats: int = 5
    seconds: float = 60.0
    say: Callable[[str], None] = field(default=_say_nothing, repr=False)


@dataclass(frozen=True)
class Row:
    """One item of a part.

    Attributes
    ----------
    item : str
        What was measured.
    ours : float
        What the package needs or reaches.
    unit : str
        Unit of `ours` and `peer`.
    peer : float or None
        The same of the peer, where there is one.
    peer_name : str
        What the peer is.
    goal : str
        What was to be reached, in words; empty: the item is told for comparison.
    met : bool or None
        Whether it was; None where there is no goal.
    """

    item: str
    ours: float
    unit: str
    peer: float | None = None
    peer_name: str = ""
    goal: str = ""
    met: bool | None = None

    @property
    def ratio(self) -> float | None:
        """Peer over ours: for a cost, how many times cheaper ours is."""
        return None if self.peer is None or self.ours == 0 else self.peer / self.ours


def _processor_time() -> float:
    """Return the seconds that this process and its ended children have spent."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def medians(functions: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the median processor time of each function, s.

    They take turns, so that a change of the machine's speed strikes all of them. Each runs once
    beforehand, unmeasured: compilation and caches are no part of what is compared.
    """
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    for function in functions.values():
        function()
    for _ in range(repeats):
        for name, function in functions.items():
            begin = _processor_time()
            function()
            seconds[name].append(_processor_time() - begin)
    return {name: statistics.median(times) for name, times in seconds.items()}
