# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The database of the plant, outside of its hosts, and what of each host has come there."""

import contextlib
import math
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmark.hosts.network import OUTSIDE
from benchmark.postgres_server import PostgresServer, running_server
from benchmark.speed.rows import Row

__all__ = ["Database", "plant_database"]

_LOOK = 0.2
_COUNT = """
SELECT count(*) FROM identification JOIN valve ON valve.id = valve_id WHERE valve.name LIKE %s
"""


class Database:
    """A server that all hosts send their history to; each has a file of its own.

    Parameters
    ----------
    server : PostgresServer
        The server.
    folder : Path
        Of the files.
    """

    def __init__(self, server: PostgresServer, folder: Path) -> None:
        self._server, self._folder = server, folder
        self._name = server.database()

    def arguments(self, host: str) -> list[str]:
        """Return the arguments of a host's processes."""
        file, url = self._folder / f"{host}.sqlite", self._server.url(self._name)
        return ["--history", str(file), "--history-url", url]

    def count(self, host: str) -> int:
        """Return the identifications of a host's valves that are on the server."""
        if not self._server.do(self._name, "SELECT to_regclass('identification')")[0][0]:
            return 0  # nobody has sent anything
        ((count,),) = self._server.do(self._name, _COUNT, (f"/{host}\\_%",))
        return int(count)

    def rows(
        self, host: str, words: str, answered: int, patience: float, begin: float | None = None
    ) -> Iterator[Row]:
        """Wait until all that a host has answered is on the server."""
        begin = time.monotonic() if begin is None else begin
        while self.count(host) < answered and time.monotonic() < begin + patience:
            time.sleep(_LOOK)
        kept = self.count(host)
        took = time.monotonic() - begin if kept >= answered else math.inf
        yield Row(f"host {words}: identifications answered", answered, "", goal="some",
                  met=answered > 0)  # fmt: skip
        yield Row("of them on the server", kept, "", goal="all", met=kept == answered)
        yield Row("after", took, "s")


@contextlib.contextmanager
def plant_database() -> Iterator[Database | None]:
    """Provide a new database on a new server; None where no server can be started."""
    with running_server(OUTSIDE) as server, tempfile.TemporaryDirectory() as folder:
        yield None if server is None else Database(server, Path(folder))
