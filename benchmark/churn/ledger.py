"""What happened, as lines of JSON that many processes append to one file."""

import json
import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

__all__ = ["Ledger"]


class Ledger:
    """A file of events: each a kind and what is known of it.

    A line is written at once, so that a process may be killed at any time.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        path.touch()

    def add(self, kind: str, **known: Any) -> None:
        """Append an event."""
        line = json.dumps({"kind": kind, "time": time.time(), **known}, ensure_ascii=False) + "\n"
        with self.path.open("ab", buffering=0) as stream:
            os.write(stream.fileno(), line.encode())

    def events(self) -> Iterator[Mapping[str, Any]]:
        """Yield all events, oldest first."""
        with self.path.open(encoding="utf-8") as stream:
            yield from map(json.loads, stream)
