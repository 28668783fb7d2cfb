"""A valve's window of ten minutes at 1 kHz: under 20 MB, and constant while it runs."""

import tracemalloc

import numpy as np
import pytest

from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import RecordBuffer, rows_arrived

BLOCK = 500
WINDOW = 600.0
CHUNKS = 2 * 1024 * 16  # bytes by which the two signals may vary as their chunks come and go


def add(buffer, block):
    seconds = (block * BLOCK + np.arange(BLOCK)) / 1000
    buffer.add_arrivals(rows_arrived(np.column_stack([seconds, seconds + 1e5, seconds * 1e-6])))


@pytest.fixture(scope="module")
def sizes():
    """Sizes of the buffer after each block since its window is full, by itself and traced."""
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        buffer = RecordBuffer(BENCH_VALVE, WINDOW)
        full = round(WINDOW * 1000 / BLOCK) + 1
        for block in range(full):
            add(buffer, block)
        own, traced = np.zeros((2, full), np.int64)
        for number in range(full):
            add(buffer, full + number)
            own[number] = buffer.nbytes
            traced[number] = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert len(buffer) == 2 * 600_001
    return own, traced


def test_under_20_megabytes(sizes):
    own, traced = sizes
    assert own.max() < traced.max() < 20e6


def test_constant_while_running(sizes):
    own, traced = sizes
    assert np.ptp(own) <= CHUNKS
    assert np.ptp(traced) <= 2 * CHUNKS  # the list and the arrays around the chunks as well
