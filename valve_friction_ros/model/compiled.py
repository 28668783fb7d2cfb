"""Compilation of numeric kernels, kept in one place.

A kernel is an ordinary Python function on scalars, arrays and named tuples. Decorated with
`compiled` it runs as machine code, compiled at its first call and cached on disk for the next
process. A kernel may call kernels, and use numbers, of this folder and of its own: the cache is
renewed when a file of either changes. Where no folder for a cache can be written, neither beside
the sources nor at home, each process compiles anew. The environment variable
``NUMBA_DISABLE_JIT=1`` runs kernels as plain Python instead, and leaves numba (110 MB) unloaded.
"""

import contextlib
import hashlib
import logging
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

__all__ = ["compiled", "compiled_products", "compiled_reductions", "kernels_are_cached"]

_P = ParamSpec("_P")
_R = TypeVar("_R")

_LOG = logging.getLogger(__name__)
_without_cache: set[str] = set()


@cache
def _tell_compilation() -> None:
    """Log the first kernel that this process compiles; one out of the cache is not compiled."""
    from numba.core import event  # noqa: PLC0415

    class FirstCompilation(event.Listener):  # type: ignore[misc]
        has_told = False

        def on_start(self, _: object) -> None:
            if not self.has_told:
                self.has_told = True
                _LOG.info("numeric code is compiled, once after an installation: about a minute")

        def on_end(self, _: object) -> None:
            """Nothing is told."""

    event.register("numba:compile", FirstCompilation())


@cache
def _sources(folder: Path) -> str:
    """Digest of the modules in a folder."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _kernel(function: Callable[_P, _R], **options: Any) -> Callable[_P, _R]:
    """Compile with a cache, if there is a place for one."""
    if os.environ.get("NUMBA_DISABLE_JIT") == "1":
        return function
    import numba  # noqa: PLC0415

    _tell_compilation()
    kernel: Any
    try:
        kernel = numba.njit(cache=True, nogil=True, **options)(function)
    except RuntimeError:  # numba's "cannot cache function: no locator available"
        kernel = numba.njit(nogil=True, **options)(function)
        _without_cache.add(function.__name__)
    _forgive_a_full_disk(kernel)
    folders = (Path(function.__code__.co_filename).parent, Path(__file__).parent)
    # Numba renews a cache when the kernel's own file changes, and has nothing public to widen that.
    # A plain function, and a kernel without a cache, have no such attribute.
    with contextlib.suppress(AttributeError):
        kernel._cache._cache_file._source_stamp = tuple(map(_sources, folders))  # noqa: SLF001
    return kernel  # type: ignore[no-any-return]


def _forgive_a_full_disk(kernel: Any) -> None:
    """Go on without the cache where it cannot be written."""
    with contextlib.suppress(AttributeError):
        save = kernel._cache.save_overload  # noqa: SLF001

        def save_if_possible(signature: object, data: object) -> None:
            try:
                save(signature, data)
            except OSError:
                _without_cache.add(kernel.__name__)

        kernel._cache.save_overload = save_if_possible  # noqa: SLF001


def kernels_are_cached() -> bool:
    """Return whether there is a place where compiled kernels are kept for the next process."""
    return not _without_cache


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` with numba, without the interpreter lock, cached on disk."""
    return _kernel(function)


def compiled_products(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` like `compiled`, and let it fuse products with sums."""
    return _kernel(function, fastmath={"contract"})


def compiled_reductions(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` like `compiled`, and let it add up in any order.

    Sums over an array then run several terms at once; the last digit of a result may differ from
    that of a sum taken in order.
    """
    return _kernel(function, fastmath={"reassoc", "contract", "nsz"})
