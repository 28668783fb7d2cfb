"""Valves and sensors as they are, to measure an identification with: `make reality`.

Nothing here is shared with the package that is measured: the plants are written anew, with finer
steps than the package's simulator. Only the module `package` calls it.
"""

import os

# One process a core is enough; more threads would only wait for each other.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
