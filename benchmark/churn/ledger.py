# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

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
