"""The latched topics of an identifier: what is known of its valve, and each number of it."""

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray

from valve_friction_ros.health import FrictionMonitor, dead_band
from valve_friction_ros.history import HistoryEntry
from valve_friction_ros.identification import SLIDING, UNITS, Result
from valve_friction_ros.nodes.identifier.parameters import NUMBER_TOPICS
from valve_friction_ros.nodes.plumbing.messages import sweep_message
from valve_friction_ros.nodes.plumbing.qos import LATCHED

__all__ = ["EstimateTopic", "NumberTopics"]

_FIGURES = (
    "dead_band",
    "friction_ratio",
    "sliding_speed",
    "fit",
    "rms",
    "threshold",
    "sigma",
    "r_squared",
)


_FRICTIONS = (*UNITS, SLIDING)


class EstimateTopic:
    """Publishes what is known of the valve in one message, when it has changed."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(DiagnosticStatus, "~/estimate", LATCHED)
        self._last: DiagnosticStatus | None = None

    def publish(self, status: DiagnosticStatus) -> None:
        """Publish a status, unless it is the one before."""
        if status != self._last:
            self._last = status
            self._publisher.publish(status)


class NumberTopics:
    """Publishes each number of a result on a topic of its own, and the sweep.

    Without the parameter ``number_topics`` it does nothing.
    """

    def __init__(self, node: Node) -> None:
        self._is_used = bool(node.get_parameter(NUMBER_TOPICS.name).value)
        if not self._is_used:
            return
        self._friction = {
            name: node.create_publisher(Float64, f"~/friction/{name}", LATCHED)
            for name in (*_FRICTIONS, *_FIGURES)
        }
        self._half_width, self._published = (
            {name: node.create_publisher(Float64, f"~/{kind}/{name}", LATCHED) for name in names}
            for kind, names in (("half_width", _FRICTIONS), ("published", UNITS))
        )
        self._sweep = node.create_publisher(Float64MultiArray, "~/sweep", LATCHED)

    def publish(self, result: Result | HistoryEntry, monitor: FrictionMonitor) -> None:
        """Publish a result that the monitor has accepted, or the numbers kept of an earlier one."""
        if not self._is_used:
            return
        ratio = monitor.diagnosis().ratio
        unknown = float("nan")
        if isinstance(result, Result):
            evidence, fit, rms = result.evidence, result.fit, result.rms
            sweep = None if result.estimate is None else result.estimate.sweep
            self._sweep.publish(sweep_message(sweep))
        else:
            evidence, (fit, rms, _) = {}, result.fit
        figures = {
            **dict.fromkeys(_FRICTIONS, unknown),
            **result.values,
            "dead_band": dead_band(result, monitor.settings.valve),
            "friction_ratio": unknown if ratio is None else ratio.value,
            "sliding_speed": result.sliding_speed,
            "fit": fit,
            "rms": rms,
            **{name: evidence.get(name, unknown) for name in ("threshold", "sigma", "r_squared")},
        }
        for name, publisher in self._friction.items():
            publisher.publish(Float64(data=figures[name]))
        for name, publisher in self._half_width.items():
            one = result.parameters.get(name)
            publisher.publish(Float64(data=unknown if one is None else one.half_width))
        for name, publisher in self._published.items():
            one = result.parameters.get(name)
            publisher.publish(Float64(data=unknown if one is None else one.published))
