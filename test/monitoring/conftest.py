"""One identified record, whose numbers the tests replace by their own."""

import pytest

from valve_friction_ros.identification import IdentificationSettings, identify
from valve_friction_ros.model import SquareWave


@pytest.fixture(scope="session")
def estimate(benches, bench_record):
    settings = IdentificationSettings(position_bias=1.13e-3)
    return identify(bench_record("low", SquareWave(), 20.8), benches["low"].valve, settings)
