# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Kernels are compiled anew when they must be, and run where nothing can be cached."""

import os

import pytest
from processes import printed

INNER = """
from valve_friction_ros.model.compiled import compiled

@compiled
def inner():
    return {}
"""
ARRAYS = """
import numpy as np
from valve_friction_ros.model.compiled import compiled

@compiled
def inner():
    return int(np.ones(4).sum())
"""
OUTER = """
from inner import inner
from valve_friction_ros.model.compiled import compiled

@compiled
def outer():
    return inner()

print(outer(), sum(outer.stats.cache_hits.values()))
"""


@pytest.fixture
def kernels(tmp_path):
    (tmp_path / "inner.py").write_text(INNER.format(1))
    (tmp_path / "outer.py").write_text(OUTER)
    return tmp_path


def told(folder, *words, **variables):
    """What a new process of Python prints."""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    return printed("-B", *words, cwd=folder, env=environment | variables)


def run(folder, **variables):
    """What the kernel `outer` answers in a new process, and whether it came out of the cache."""
    value, hits = map(int, told(folder, "outer.py", **variables).split())
    return value, bool(hits)


def test_a_change_of_a_kernel_that_another_one_calls(kernels):
    """Numba itself would go on with the compiled `outer`, the old `inner` in it."""
    assert run(kernels) == (1, False)
    assert run(kernels) == (1, True)
    (kernels / "inner.py").write_text(INNER.format(2))
    assert run(kernels) == (2, False)
    assert run(kernels) == (2, True)


def test_a_kernel_out_of_the_cache_serves_one_that_is_compiled(kernels):
    """What numba needs to compile is not loaded with the first."""
    (kernels / "inner.py").write_text(ARRAYS)
    assert run(kernels) == (4, False)
    for part in (kernels / "__pycache__").glob("outer.*"):
        part.unlink()
    alone = "import sys, inner; print(inner.inner(), 'scipy.linalg' in sys.modules)"
    assert told(kernels, "-c", alone).split() == ["4", "False"]
    assert run(kernels) == (4, False)
    assert run(kernels) == (4, True)


def test_a_first_compilation_is_logged_once(kernels):
    """Two kernels are compiled: one line. What comes out of the cache is none."""
    (kernels / "logged.py").write_text(
        "import logging, sys\n"
        "logging.basicConfig(level=logging.INFO, stream=sys.stdout, format='told: %(message)s')\n"
        "import outer\n"
    )
    logged = [told(kernels, "logged.py").count("told: compiling") for _ in range(2)]
    assert logged == [1, 0]


def test_nowhere_to_cache(kernels):
    """As of a read-only installation, used by somebody without a home."""
    (kernels / "__pycache__").write_text("a file, so that no folder can be made")
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null"}
    assert run(kernels, **nowhere) == (1, False)
    assert run(kernels, **nowhere) == (1, False)


def test_another_thread_may_load_scipy_meanwhile(tmp_path):
    """As that of a node in the process of a user: its import must not fail."""
    code = """
import importlib, threading
from valve_friction_ros.model import compiled

def load_numba(_):
    try:
        import scipy.linalg.cython_blas
    except ImportError:
        print("hidden")
    other = threading.Thread(target=lambda: print(importlib.import_module("scipy.linalg").norm(4)))
    other.start()
    other.join()

compiled.import_module = load_numba
compiled._without_scipy()
"""
    assert told(tmp_path, "-c", code).split() == ["hidden", "4.0"]
