"""What is sent to the workers of a cluster, and what they do with it.

A call is the name of a function and what it is given, pickled once more, so that only a worker
opens it: the scheduler needs Dask and nothing of this package.
"""

import contextlib
import pickle
import socket
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from importlib import metadata
from typing import Any, TypeVar

from valve_friction_ros import __version__

__all__ = ["PACKAGE", "answers", "call", "versions"]

PACKAGE = "valve_friction_ros"


_Task = TypeVar("_Task")
_Answer = TypeVar("_Answer")

_COMPARED = ("numpy", "scipy", "numba", "distributed")
"""Libraries whose version matters: those that calculate, as it may change the last digits."""

_ALONE = threading.Lock()
"""One batch at a time in a process: figures are drawn by a library that is not made for threads."""


class _Call:
    """Becomes the value of a function where it is unpickled."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        self._call = (function, arguments)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[object, ...]]:
        """Give the call."""
        return self._call


def call(function: Callable[..., Any], *arguments: object) -> bytes:
    """Return bytes from which `pickle.loads` makes the value of a function, where it is called."""
    return pickle.dumps(_Call(function, arguments))


def versions() -> dict[str, str]:
    """Return the versions of this process that matter to results."""
    found = {PACKAGE: __version__}
    for name in _COMPARED:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@contextlib.contextmanager
def _drafts_of_worker() -> Iterator[None]:
    """Have temporary files in the worker's folder, which Dask clears when the worker was killed."""
    from distributed import get_worker  # noqa: PLC0415 - an extra

    before = tempfile.tempdir
    tempfile.tempdir = get_worker().local_directory
    try:
        yield
    finally:
        tempfile.tempdir = before


def answers(
    version: str, work: Callable[[_Task], _Answer], tasks: Sequence[_Task]
) -> list[_Answer]:
    """Answer a batch, on a worker of the same version as whoever asks.

    Raises ImportError if it is another one.
    """
    if version != __version__:  # a worker that came after they were compared
        raise ImportError(f"{socket.gethostname()} has {PACKAGE} {__version__}")
    with _ALONE, _drafts_of_worker():
        return [work(task) for task in tasks]
