"""The latched topics of an identifier's results."""

from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray

from valve_friction_ros.health import FrictionMonitor, dead_band
from valve_friction_ros.identification import UNITS, Result
from valve_friction_ros.nodes.plumbing.messages import sweep_message
from valve_friction_ros.nodes.plumbing.qos import LATCHED

__all__ = ["ResultTopics"]

_FIGURES = (
    "dead_band",
    "coulomb_friction_ratio",
    "fit",
    "rms",
    "threshold",
    "sigma",
    "r_squared",
)


class ResultTopics:
    """Publishes each number of a result on a topic of its own, and the sweep."""

    def __init__(self, node: Node) -> None:
        self._friction = {
            name: node.create_publisher(Float64, f"~/friction/{name}", LATCHED)
            for name in (*UNITS, *_FIGURES)
        }
        self._half_width, self._published = (
            {name: node.create_publisher(Float64, f"~/{kind}/{name}", LATCHED) for name in UNITS}
            for kind in ("half_width", "published")
        )
        self._sweep = node.create_publisher(Float64MultiArray, "~/sweep", LATCHED)

    def publish(self, result: Result, monitor: FrictionMonitor) -> None:
        """Publish a result that the monitor has accepted."""
        ratio = monitor.diagnosis().ratio
        evidence = result.evidence
        unknown = float("nan")
        figures = {
            **result.values,
            "dead_band": dead_band(result, monitor.settings.valve),
            "coulomb_friction_ratio": unknown if ratio is None else ratio.value,
            "fit": result.fit,
            "rms": result.rms,
            **{name: evidence.get(name, unknown) for name in ("threshold", "sigma", "r_squared")},
        }
        for name, publisher in self._friction.items():
            publisher.publish(Float64(data=figures[name]))
        for name, publisher in self._half_width.items():
            publisher.publish(Float64(data=result.parameters[name].half_width))
        for name, publisher in self._published.items():
            publisher.publish(Float64(data=result.parameters[name].published))
        self._sweep.publish(
            sweep_message(None if result.estimate is None else result.estimate.sweep)
        )
