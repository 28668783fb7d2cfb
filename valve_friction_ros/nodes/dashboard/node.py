# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A plant's valves in a browser: their diagnosis, history and signals, and their services."""

import contextlib
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.signals import SignalHandlerOptions

from valve_friction_ros.dashboard import DashboardOptions, Plant
from valve_friction_ros.dashboard.accounts import Access, accounts_from
from valve_friction_ros.dashboard.context import INSTALL, DashboardContext, GuardedOperator
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.dashboard.kept_valves import HistoryOperator
from valve_friction_ros.dashboard.live_state import Sources
from valve_friction_ros.history import server_from
from valve_friction_ros.nodes.dashboard.raw_statuses import statuses_in
from valve_friction_ros.nodes.dashboard.service_calls import ServiceCalls
from valve_friction_ros.nodes.dashboard.watched_signals import WatchedSignals
from valve_friction_ros.nodes.plumbing.managed_node import ManagedNode
from valve_friction_ros.nodes.plumbing.memory import keep_little_memory
from valve_friction_ros.nodes.plumbing.output_folder import folder_of
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters, values_of
from valve_friction_ros.nodes.plumbing.polled_node import TurnExecutor
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import statuses
from valve_friction_ros.nodes.plumbing.running import WRONG_REQUESTS, cannot_start
from valve_friction_ros.nodes.plumbing.stop_request import StopRequest
from valve_friction_ros.settings import NODES

_PAUSE = 0.05
"""Time between two turns, s: for so long messages gather."""
_MISSING = f"cannot start: the dashboard needs NiceGUI, which is not installed: run `{INSTALL}`"


def _options(values: Mapping[str, Any]) -> DashboardOptions:
    """Return the options that parameters give; raises ValueError or OSError for wrong ones."""

    def file(name: str) -> Path | None:
        return Path(values[name]).expanduser() if values[name] else None

    return DashboardOptions(
        access=Access(
            host=values["host"],
            host_names=tuple(filter(None, map(str.strip, values["host_names"].split(",")))),
            accounts=accounts_from(file("accounts_file")),
            certificate=file("certificate_file"),
            key=file("key_file"),
            session_hours=values["session_hours"],
            session_file=file("session_file"),
        ),
        port=values["port"],
        history=server_from(values["history_url"]) or file("history_file"),
        reports=folder_of(values["report_folder"], "reports"),
        bags=folder_of(values["save_folder"], "saved"),
        alarms=folder_of(values["alarm_folder"], "alarms"),
        time_zone=values["time_zone"],
        silence=values["silence"],
    )


class Dashboard(ManagedNode):
    """Hears the valves and fills their store; calls services for the pages.

    The executable `dashboard` serves the pages beside it. Raises ValueError or OSError for wrong
    parameters.

    Parameters
    ----------
    **named
        What `rclpy.node.Node` takes, such as `parameter_overrides`.
    """

    def __init__(self, **named: Any) -> None:
        super().__init__("dashboard", **named)
        declare_parameters(self, NODES["dashboard"])
        self.options = _options(values_of(self, NODES["dashboard"]))
        self.plant = Plant(self.options.silence)
        self.calls = ServiceCalls()
        self.signals = WatchedSignals(self._sources_of)
        self.begin()

    def configure(self) -> None:
        """Subscribe to the diagnostics."""
        self._diagnostics = PolledSubscription(
            self, DiagnosticArray, "/diagnostics", statuses(), raw=True
        )
        self.opened.callback(self.calls.rest, self)
        self.opened.callback(self.signals.rest)

    def _sources_of(self, identifier: str) -> Sources:
        heard = self.plant.valve(identifier, time.monotonic())
        return Sources() if heard is None else heard.view.sources

    def poll(self) -> None:
        """Take what has been heard, and go on with what is asked."""
        now = time.monotonic()
        heard = self._diagnostics.take()
        if not self.is_active:
            return
        for taken in heard:
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
    history = HistoryCache(options.history)
    context = DashboardContext(
        options,
        node.plant,
        history,
        GuardedOperator(HistoryOperator(history, node.calls), visitors, log),
        node.signals,
        visitors,
    )

    def tell() -> None:
        if options.access.warning:
            node.get_logger().warning(options.access.warning)
        log(f"ready: open {options.address}")

    if not stop.has_come:
        server.serve(context, tell, log, lambda: node.is_active)
    stop.is_followed = True
    return 0


if __name__ == "__main__":
    sys.exit(main())
