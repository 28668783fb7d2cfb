"""A Dask cluster: the connection to its scheduler, and what its workers have in common with us."""

import asyncio
import contextlib
import logging
import pickle
import warnings
from collections.abc import Iterator
from typing import Any

from valve_friction_ros import __version__
from valve_friction_ros.fleet.sharing.remote_calls import PACKAGE, call, versions

__all__ = ["NO_WORKER", "Cluster", "cluster_at"]

_REMEDY = "run `pip install 'distributed>=2026.8'` (the extra `cluster`)"
NO_WORKER = 30.0
"""How long a worker is waited for while there is none, s."""
_AWAY = 10.0
"""How long a scheduler is waited for, s."""
_CLOSING = 2.0
"""How long the connection may take to close, s."""


class Cluster:
    """A Dask cluster at the other end of a connection.

    Attributes
    ----------
    address : str
        Of its scheduler.
    client : distributed.Client
        The connection.
    """

    def __init__(self, address: str, client: Any) -> None:
        self.address = address
        self.client = client

    def gone(self) -> str:
        """Say that the scheduler has gone."""
        return f"{self.address}: the scheduler has gone: once it is back, the same command goes on"

    def differs(self, cause: str) -> str:
        """Say that a worker cannot do the work."""
        return (
            f"{self.address}: a worker is unlike this machine ({cause}): install {PACKAGE} "
            f"{__version__} with the same extras on all of them"
        )

    def without_workers(self) -> str:
        """Say that there is no worker."""
        return (
            f"{self.address}: no worker has come in {NO_WORKER:g} s: start some by "
            f"`dask worker {self.address} --nthreads 1`"
        )

    def require_scheduler(self) -> None:
        """Refuse to go on without the scheduler."""
        if self.client.status != "running":
            raise ValueError(self.gone())

    def threads(self) -> int:
        """Count the threads of all workers."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, asyncio.TimeoutError):
            raise ValueError(self.gone()) from None

    def compare(self) -> list[str]:
        """Refuse workers without this package or with another version of it; return other unlikes.

        Raises ValueError if there is no worker.
        """
        try:
            self.client.wait_for_workers(1, timeout=NO_WORKER)
            told = self.client.run(pickle.loads, call(versions), on_error="return")
        except (OSError, asyncio.TimeoutError):
            self.require_scheduler()
            raise ValueError(self.without_workers()) from None
        own, notes = versions(), set()
        for worker, theirs in told.items():
            if not isinstance(theirs, dict):
                raise ValueError(self.differs(f"{worker}: {theirs}"))
            if theirs[PACKAGE] != own[PACKAGE]:
                raise ValueError(self.differs(f"{worker} has {PACKAGE} {theirs[PACKAGE]}"))
            notes |= {
                f"workers have {name} {theirs.get(name)}, and this machine has {version}: the last "
                "digits of results may differ"
                for name, version in own.items()
                if theirs.get(name) != version
            }
        return sorted(notes)


async def _reach(address: str) -> None:
    """Connect and part again: a `Client` that cannot connect leaves threads that may lock up."""
    from distributed import Security  # noqa: PLC0415 - an extra
    from distributed.comm import connect  # noqa: PLC0415

    comm = await connect(address, timeout=_AWAY, **Security().get_connection_args("client"))
    await comm.close()


@contextlib.contextmanager
def cluster_at(address: str) -> Iterator[Cluster]:
    """Connect to the scheduler of a Dask cluster, ``tcp://host:port`` or ``tls://host:port``.

    Certificates and limits of time are those of Dask's own configuration.

    Raises ValueError, one line, if Dask is not installed, or the scheduler does not answer.
    """
    try:
        import dask  # noqa: PLC0415 - an extra, and slow to import
        from distributed import Client  # noqa: PLC0415
    except ImportError as error:
        raise ValueError(f"--scheduler needs Dask distributed ({error}): {_REMEDY}") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # one line is said here
    with contextlib.ExitStack() as stack:
        stack.enter_context(dask.config.set({"distributed.comm.timeouts.connect": _AWAY}))
        try:
            asyncio.run(_reach(address))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # versions are compared by `compare`
                client = Client(address, timeout=_AWAY, set_as_default=False)
        except (OSError, ValueError, TypeError, asyncio.TimeoutError) as error:
            cause = " ".join(str(error).split())[:200]
            raise ValueError(f"{address}: no scheduler answers: {cause}") from None
        stack.callback(client.close, timeout=_CLOSING)
        yield Cluster(address, client)
