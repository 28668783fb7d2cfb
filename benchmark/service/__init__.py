"""Weeks of a valve in closed-loop service, to measure the evidence of its moves: `make service`.

The plants are those of `benchmark.reality`, which shares no code with the package: friction by
Stribeck's curve or by bristles, sensors with noise, converters and late stamps.
"""

import os

# One process a core is enough; more threads would only wait for each other.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
