"""Counts of the results of many recordings."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from valve_friction_ros.fleet.results_file import Entry
from valve_friction_ros.fleet.row import Cell

__all__ = ["REFUSED", "Reason", "Tally", "tally"]

REFUSED = "refused"

_NUMBER = re.compile(r"[-+−]?\b\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Reason:
    """A reason of refusals, its numbers left open; its count of valves and its first recording."""

    text: str
    count: int
    example: str


@dataclass
class Tally:
    """Counts of valves: by the verdict on their Coulomb friction, or `REFUSED`."""

    outcomes: Counter[str] = field(default_factory=Counter)
    _reasons: Counter[str] = field(default_factory=Counter)
    _examples: dict[str, str] = field(default_factory=dict)

    def add(self, recording: str, verdict: Cell, error: Cell) -> None:
        """Count a valve by the verdict on its Coulomb friction, or by its error."""
        if not error:
            self.outcomes[str(verdict)] += 1
            return
        self.outcomes[REFUSED] += 1
        reason = _NUMBER.sub("…", str(error))
        self._reasons[reason] += 1
        self._examples.setdefault(reason, recording)

    def reasons(self) -> list[Reason]:
        """Return the reasons of refusals, the most frequent first."""
        return [
            Reason(text, count, self._examples[text]) for text, count in self._reasons.most_common()
        ]


def tally(entries: Iterable[Entry]) -> Tally:
    """Count the valves of all entries."""
    found = Tally()
    for entry in entries:
        for row in entry.rows:
            found.add(entry.recording, row["coulomb_friction_verdict"], row["error"])
    return found
