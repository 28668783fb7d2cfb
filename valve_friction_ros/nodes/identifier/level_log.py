"""Each change of a valve's level, logged once."""

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from valve_friction_ros.health import Level

__all__ = ["LevelLog"]


class LevelLog:
    """Logs the level of a valve when it has changed; it begins at OK."""

    def __init__(self, node: Node) -> None:
        self._log = node.get_logger()
        self._level = Level.OK

    def follow(self, status: DiagnosticStatus) -> None:
        """Log the level of a status, if it is not the one before."""
        level = Level(status.level[0])
        if level == self._level:
            return
        line = f"level {self._level.name} → {level.name}: {status.message}"
        self._level = level
        # rclpy wants a severity to keep to its line of code.
        if level is Level.OK:
            self._log.info(line)
        elif level is Level.WARN:
            self._log.warning(line)
        else:
            self._log.error(line)
