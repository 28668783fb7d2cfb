"""The sub-command `identify-folder` on the workers of a Dask cluster."""

import csv
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from dask_workers import local_cluster
from documentation import PROJECT

from valve_friction_ros.commands.folder import sharing

pytest.importorskip("distributed", reason="run `make venv-cluster`")

PATIENCE = 100.0  # s, for one thing to happen on a loaded machine
FAULTY = Path(__file__).with_name("faulty_cluster.py")
"""What the workers do instead, by the names of files."""


@pytest.fixture(scope="module")
def address():
    with local_cluster() as found:
        yield found.scheduler_address
