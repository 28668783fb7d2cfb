# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Compilation of numeric kernels, kept in one place.

A kernel is an ordinary Python function on scalars, arrays and named tuples. Decorated with
`compiled` it runs as machine code, compiled at its first call and cached on disk for the next
process. It loops over its arrays: for an expression of whole arrays numba compiles broadcasting and
messages about shapes as well, for seconds. A kernel may call kernels, and use numbers, of this
folder and of its own: the cache is renewed when a file of either changes. Where no folder for a
cache can be written, neither beside the sources nor at home, each process compiles again. numba
(60 MB) is loaded by the first call of a kernel. The environment variable ``NUMBA_DISABLE_JIT=1``
runs kernels as plain Python instead.
"""

import contextlib
import hashlib
import logging
import os
import sys
import threading
from collections.abc import Callable
from functools import cache, update_wrapper
from importlib import import_module
from importlib.abc import MetaPathFinder
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

_P = ParamSpec("_P")
_R = TypeVar("_R")

_LOG = logging.getLogger(__name__)
_without_cache: set[str] = set()


@cache
def _tell_compilation() -> None:
    """Log the first kernel that this process compiles; a kernel from the cache is not compiled."""
    from numba.core import event  # noqa: PLC0415

    class FirstCompilation(event.Listener):  # type: ignore[misc]
        has_told = False

        def on_start(self, _: object) -> None:
            if not self.has_told:
                self.has_told = True
                _LOG.info("compiling numeric code, once after installation: about a minute")

        def on_end(self, _: object) -> None:
            """Log nothing."""

    event.register("numba:compile", FirstCompilation())


@cache
def _sources(folder: Path) -> str:
    """Digest of the modules in a folder."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _Kernel:
    """A kernel that is handed to numba at its first use: its call, or that of a kernel using it."""

    _making = threading.RLock()

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self._function, self._options = function, options

    def __call__(self, *arguments: Any) -> Any:
        return self._numba_kernel(*arguments)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of numba's kernel, such as the type by which numba knows a kernel."""
        if name != "_numba_kernel":
            return getattr(self._numba_kernel, name)
        with self._making:
            if "_numba_kernel" not in self.__dict__:
                self.__dict__[name] = _numba_kernel(self._function, **self._options)
        return self.__dict__[name]


def _kernel(function: Callable[_P, _R], **options: Any) -> Callable[_P, _R]:
    if os.environ.get("NUMBA_DISABLE_JIT") == "1":
        return function
    return cast("Callable[_P, _R]", _Kernel(function, options))


def _numba_kernel(function: Callable[_P, _R], **options: Any) -> Callable[_P, _R]:
    """Compile with a cache, if there is a place for one."""
    import numba  # noqa: PLC0415

    _tell_compilation()
    kernel: Any
    try:
        kernel = numba.njit(cache=True, nogil=True, **options)(function)
    except RuntimeError:  # numba's "cannot cache function: no locator available"
        kernel = numba.njit(nogil=True, **options)(function)
        _without_cache.add(function.__name__)
    _forgive_a_full_disk(kernel)
    _load_alone(kernel)
    folders = (Path(function.__code__.co_filename).parent, Path(__file__).parent)
    # Numba renews a cache when the kernel's own file changes; it has no public way to widen that.
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


class _MissingHere(MetaPathFinder):
    """Hides a package that is not yet loaded from the thread that makes this, and from no other."""

    def __init__(self, package: str) -> None:
        self._package, self._thread = package, threading.get_ident()

    def find_spec(self, name: str, *_: object) -> None:
        """Refuse the package."""
        if name == self._package and threading.get_ident() == self._thread:
            raise ModuleNotFoundError(f"{name} is not needed here", name=name)


def _load_alone(kernel: Any) -> None:
    """Load machine code from the cache without all that numba needs for compilation.

    Numba would first register every function that it can compile, which takes longer than loading
    the kernels of an identification. Compilation does that by itself.
    """
    from numba.core.runtime import rtsys  # noqa: PLC0415

    with contextlib.suppress(AttributeError):
        load, guard = kernel._cache._load_overload, kernel._cache._guard_against_spurious_io_errors  # noqa: SLF001

        def load_alone(signature: object, target: object) -> object:
            _without_scipy()
            rtsys.initialize(target)
            with guard():
                return load(signature, target)

        kernel._cache.load_overload = load_alone  # noqa: SLF001


@cache
def _without_scipy() -> None:
    """Load numba's support of arrays without `scipy.linalg`, which is as slow to load as numpy.

    Numba asks for scipy's BLAS, and does without if it is missing. No kernel multiplies matrices.
    """
    missing = _MissingHere("scipy.linalg")
    sys.meta_path = [missing, *sys.meta_path]  # a new list: others may be searching the old one
    try:
        import_module("numba.np.arraymath")
    finally:
        sys.meta_path = [one for one in sys.meta_path if one is not missing]


def kernels_are_cached() -> bool:
    """Return whether there is a place where compiled kernels are kept for the next process."""
    return not _without_cache


def find_cache() -> bool:
    """Return whether there is a place for the cache, before anything is compiled; needs numba."""
    _numba_kernel(find_cache)
    return kernels_are_cached()


def note_cache(is_there: bool) -> None:
    """Note whether another process, which will compile, has found a place for the cache."""
    if not is_there:
        _without_cache.add(find_cache.__name__)


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
