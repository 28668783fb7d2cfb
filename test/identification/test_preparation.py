# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""After the preparation no record has anything compiled."""

import subprocess
import sys

CODE = """
import gc
import numpy as np
from numba.core.dispatcher import Dispatcher
from valve_friction_ros.identification import METHODS, IdentificationSettings
from valve_friction_ros.identification.methods import compile_methods
from valve_friction_ros.model import *

def compiled():
    kernels = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {one.py_func.__qualname__: len(one.signatures) for one in kernels}

compile_methods()
before = compiled()
assert before["run_stem"]
for parameters, period in ((LOW_FRICTION, 0.005), (HIGH_FRICTION, 0.01), (GRAPHITE_PACKING, 0.01)):
    valve = GRAPHITE_VALVE if parameters is GRAPHITE_PACKING else BENCH_VALVE
    pressure = SineWave(period=7.0).sample(period * np.arange(2000))
    position = simulate(valve, parameters, pressure, period).position
    position = position + 2e-6 * np.random.default_rng(1).standard_normal(2000)
    for method in ("plant", "bench", "published"):
        METHODS[method](Recording(period, pressure, position), valve, IdentificationSettings())
changed = {name: count for name, count in compiled().items() if before.get(name) != count}
assert not changed, changed
"""


def test_nothing_is_compiled_after_it():
    subprocess.run([sys.executable, "-c", CODE], check=True, timeout=110)
