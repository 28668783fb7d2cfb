"""Identification and refinement of one record, 62.4 s at 1 kHz."""

from collections.abc import Callable, Iterator
from typing import Any

from benchmark.plants import PLANTS
from benchmark.speed.records import PERIOD, SAMPLES, pressure
from benchmark.speed.rows import Row, Settings, medians
from valve_friction_ros.identification import RefusalError, identify_refined, published_estimate
from valve_friction_ros.model import Recording, SensorNoise, Valve

__all__ = ["measure"]

_NOISES = {
    "10 µm / 100 Pa": SensorNoise(10e-6, 100.0, 1),
    "28.6 µm / 165 Pa": SensorNoise(28.6e-6, 165.0, 1),
}
_GOAL = 0.2
"""Processor time of a Karnopp valve, s."""


def _tries(identification: Callable[[Recording, Valve], Any], one: Recording, valve: Valve) -> Any:
    """Identify, or be refused; both take their time."""
    try:
        return identification(one, valve)
    except RefusalError as refusal:
        return refusal


def measure(settings: Settings) -> Iterator[Row]:
    """Measure the whole of it beside the published method alone."""
    for name, plant in PLANTS.items():
        driving = pressure("square", SAMPLES)
        clean = Recording(PERIOD, driving, plant.respond(driving, PERIOD))
        for noise_name, noise in _NOISES.items():
            record = noise.applied_to(clean)
            item = f"{name}, {noise_name}"
            settings.say(f"refinement, {item}")
            seconds = medians(
                {
                    "refined": lambda one=record, valve=plant.valve: _tries(
                        identify_refined, one, valve
                    ),
                    "published": lambda one=record, valve=plant.valve: _tries(
                        published_estimate, one, valve
                    ),
                },
                settings.repeats,
            )
            is_karnopp = plant.is_karnopp
            yield Row(
                item,
                1e3 * seconds["refined"],
                "ms",
                1e3 * seconds["published"],
                "the published method alone",
                f"{1e3 * _GOAL:.0f} ms" if is_karnopp else "",
                seconds["refined"] <= _GOAL if is_karnopp else None,
            )
