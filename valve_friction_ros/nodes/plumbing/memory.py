# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Memory that the C library keeps though nobody uses it."""

import contextlib
import ctypes

_MALLOC = {-8: 2, -3: 131_072, -1: 131_072}
"""M_ARENA_MAX, M_MMAP_THRESHOLD (bytes) and M_TRIM_THRESHOLD (bytes) of malloc.h."""


def keep_little_memory() -> None:
    """Let all threads share two arenas of glibc's memory, and give back what is free at once.

    An arena a thread took the dashboard 50 MB more, and kept pages of the browser 10 MB. Large
    arrays cost more time then. Elsewhere than with glibc nothing is done.
    """
    with contextlib.suppress(AttributeError, OSError):
        mallopt = ctypes.CDLL(None).mallopt
        for option, value in _MALLOC.items():
            mallopt(option, value)


def give_back_memory() -> None:
    """Give back what is free now: after work that took much and is seldom done.

    Elsewhere than with glibc nothing is done.
    """
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)
