"""A plant's valves in a browser: their diagnosis, history and signals, and their services."""

import contextlib
import sys
import threading
import time
from collections.abc import Sequence

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.signals import SignalHandlerOptions

from valve_friction_ros.dashboard import Plant
from valve_friction_ros.dashboard.heard.valve_view import Sources
from valve_friction_ros.dashboard.options import INSTALL
from valve_friction_ros.nodes.dashboard.parameters import PARAMETERS, options_from
from valve_friction_ros.nodes.dashboard.raw_statuses import statuses_in
from valve_friction_ros.nodes.dashboard.service_calls import ServiceCalls
from valve_friction_ros.nodes.dashboard.watched_signals import WatchedSignals
from valve_friction_ros.nodes.plumbing.memory import keep_little_memory
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters, values_of
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, TurnExecutor
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import statuses
from valve_friction_ros.nodes.plumbing.running import WRONG_REQUESTS, cannot_start
from valve_friction_ros.nodes.plumbing.stop_request import StopRequest

__all__ = ["PARAMETERS", "Dashboard", "main"]

_PAUSE = 0.05
"""Time between two turns, s: for so long messages gather."""
_MISSING = f"cannot start: the dashboard needs NiceGUI, which is not installed: run `{INSTALL}`"


class Dashboard(PolledNode):
    """Hears the valves and fills their store; calls services for the pages."""

    def __init__(self) -> None:
        super().__init__("dashboard")
        declare_parameters(self, PARAMETERS)
        self.options = options_from(values_of(self, PARAMETERS))
        self.plant = Plant(self.options.silence)
        self.calls = ServiceCalls()
        self.signals = WatchedSignals(self._sources_of)
        self._diagnostics = PolledSubscription(
            self, DiagnosticArray, "/diagnostics", statuses(), raw=True
        )

    def _sources_of(self, identifier: str) -> Sources:
        heard = self.plant.valve(identifier, time.monotonic())
        return Sources() if heard is None else heard.view.sources

    def poll(self) -> None:
        """Take what has been heard, and go on with what is asked."""
        now = time.monotonic()
        for taken in self._diagnostics.take():
            with contextlib.suppress(ValueError):  # anybody can publish other bytes
                for status in statuses_in(taken.message):
                    self.plant.hear(status, now)
        self.calls.step(self)
        self.signals.step(self)


class _Turning:
    """Takes the node's turns in a thread, as long as the context lasts."""

    def __init__(self, node: Dashboard) -> None:
        self._node = node
        self._stop = threading.Event()
        self._executor = TurnExecutor()
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._run, name="graph", daemon=True)

    def _run(self) -> None:
        while not self._stop.wait(_PAUSE) and rclpy.ok():
            self._executor.turn()
            self._node.poll_guarded()

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(1.0)
        self._executor.shutdown(0.1)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node and the server of its pages until Ctrl-C or SIGTERM; return the exit code."""
    keep_little_memory()
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        node = Dashboard()
    except (*WRONG_REQUESTS, OSError) as error:
        rclpy.try_shutdown()
        return cannot_start(error)
    with contextlib.ExitStack() as limited:
        try:
            with _Turning(node):  # it meets the valves while the library of the pages is imported
                return _serve(node, limited)
        finally:
            node.destroy_node()
            rclpy.try_shutdown()


def _serve(node: Dashboard, limited: contextlib.ExitStack) -> int:
    """Serve the pages of a node; return the exit code.

    Once it serves, Ctrl-C leaves a limited time to all that is within `limited`.
    """
    # Libraries for other uses, 10 MB: engineio, which is imported below, does without them.
    for unused in ("aiohttp", "tornado"):
        sys.modules.setdefault(unused, None)  # type: ignore[arg-type]
    try:
        from valve_friction_ros.dashboard.board import Board  # noqa: PLC0415
        from valve_friction_ros.dashboard.guarded_operator import GuardedOperator  # noqa: PLC0415
        from valve_friction_ros.dashboard.kept import KeptHistory  # noqa: PLC0415
        from valve_friction_ros.dashboard.pages import server  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name and error.name.split(".")[0] == __name__.split(".", maxsplit=1)[0]:
            raise
        print(_MISSING, file=sys.stderr)  # noqa: T201
        return 2
    options, log = node.options, node.get_logger().info
    stop = limited.enter_context(StopRequest())
    try:
        server.require_free(options.access.host, options.port)
        visitors = server.guarded(options.access, log)
    except (*WRONG_REQUESTS, OSError) as error:
        stop.is_followed = True
        return cannot_start(error)
    board = Board(
        options,
        node.plant,
        KeptHistory(options.history),
        GuardedOperator(node.calls, visitors, log),
        node.signals,
        visitors,
    )

    def tell() -> None:
        if options.access.warning:
            node.get_logger().warning(options.access.warning)
        log(f"ready: open {options.address}")

    if not stop.has_come:
        server.serve(board, tell, log)
    stop.is_followed = True
    return 0


if __name__ == "__main__":
    sys.exit(main())
