"""Compilation of numeric kernels, kept in one place.

A kernel is an ordinary Python function on scalars, arrays and named tuples. Decorated with
`compiled` it runs as machine code, compiled at its first call and cached on disk for the next
process. The cache of a kernel is renewed when its own file changes, not when only a kernel that it
calls does: after such a change run ``make clean``. The environment variable
``NUMBA_DISABLE_JIT=1`` runs kernels as plain Python instead.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numba

__all__ = ["compiled", "compiled_products", "compiled_reductions"]

_P = ParamSpec("_P")
_R = TypeVar("_R")


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` with numba, without the interpreter lock, cached on disk."""
    kernel: Callable[_P, _R] = numba.njit(cache=True, nogil=True)(function)
    return kernel


def compiled_products(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` like `compiled`, and let it fuse products with sums."""
    kernel: Callable[_P, _R] = numba.njit(cache=True, nogil=True, fastmath={"contract"})(function)
    return kernel


def compiled_reductions(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile `function` like `compiled`, and let it add up in any order.

    Sums over an array then run several terms at once; the last digit of a result may differ from
    that of a sum taken in order.
    """
    kernel: Callable[_P, _R] = numba.njit(
        cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"}
    )(function)
    return kernel
