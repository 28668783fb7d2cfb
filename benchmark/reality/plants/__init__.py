"""Simulated valves that share no code with the package."""

from benchmark.reality.plants.motion import Motion, move
from benchmark.reality.plants.parameters import PACKINGS, Body, Friction, Law, Plant, Trend

__all__ = ["PACKINGS", "Body", "Friction", "Law", "Motion", "Plant", "Trend", "move"]
