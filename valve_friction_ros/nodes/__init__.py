"""ROS 2 nodes: they translate messages and parameters, nothing else."""

import os

# Read when numpy is imported: more threads only wait for each other in matrices as small as these.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
