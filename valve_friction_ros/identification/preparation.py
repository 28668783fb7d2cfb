"""Compilation of what the methods run, before the first record comes."""

import numpy as np

from valve_friction_ros.identification.methods import identify
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SineWave,
    compile_kernels,
    simulate,
)

__all__ = ["compile_methods"]


def compile_methods() -> None:
    """Compile all kernels, or load their compiled forms, by identifying six simulated seconds.

    Takes a second, and up to a minute the first time on a machine.
    """
    compile_kernels()
    period, count = 0.01, 600
    pressure = SineWave(period=3.0).sample(period * np.arange(count))
    position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, period).position
    random = np.random.default_rng(0)
    noisy = position + 1e-6 * random.standard_normal(count)
    identify(Recording(period, pressure + 5.0 * random.standard_normal(count), noisy), BENCH_VALVE)
