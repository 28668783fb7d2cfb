# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A participant of the middleware: a node in a context of its own."""

import contextlib
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor


class Participant(contextlib.AbstractContextManager["Participant"]):
    """A node that hears others while it is spun; it leaves where the `with` of it ends.

    Parameters
    ----------
    name : str
        Name of the node.
    domain : int or None
        Its domain; None: that of the environment.
    options
        Further ones of a node.
    """

    def __init__(self, name: str, domain: int | None = None, **options: Any) -> None:
        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context, domain_id=domain)
        self.node = rclpy.create_node(name, context=self.context, enable_rosout=False, **options)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave politely."""
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def wait(self, is_met: Callable[[], bool], limit: float) -> bool:
        """Listen until something is so; return whether it came so within a limit, s."""
        end = time.monotonic() + limit
        while not is_met():
            if time.monotonic() > end:
                return False
            self.spin(0.05)
        return True

    def answer(self, call: Any, limit: float) -> Any:
        """Listen until a call is answered; return its answer, None if none came in time."""
        self._executor.spin_until_future_complete(call, limit)
        return call.result() if call.done() else None
