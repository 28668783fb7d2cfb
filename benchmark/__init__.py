"""The full check of what an identification must reach: `make accuracy`."""

import os

# One process a core is enough; more threads would only wait for each other.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
