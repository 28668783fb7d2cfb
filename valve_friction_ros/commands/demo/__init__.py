"""Sub-command `demo`: a simulated valve whose friction grows."""

from valve_friction_ros.commands.demo.command import REFUSALS, run

__all__ = ["REFUSALS", "run"]
