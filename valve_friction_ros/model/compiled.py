"""Compilation of numeric kernels, kept in one place.

A kernel is an ordinary Python function on scalars, arrays and named tuples. Decorated with
`compiled` it runs as machine code, compiled at its first call and cached on disk for the next
process. The environment variable ``NUMBA_DISABLE_JIT=1`` runs it as plain Python instead.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numba

__all__ = ["compiled"]

_P = ParamSpec("_P")
_R = TypeVar("_R")


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` with numba, without the interpreter lock, cached on disk."""
    kernel: Callable[_P, _R] = numba.njit(cache=True, nogil=True)(function)
    return kernel
