# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifier, frozen for good within C when a file says so, as a node to start."""

import ctypes
import sys
from pathlib import Path

SCRIPT = Path(__file__)
FREEZE = "freeze"
"""Name of the file, in the node's working directory, that names what freezes."""
LOOP, MIDDLEWARE, CLEAN_UP = "loop", "middleware", "clean-up"

if __name__ == "__main__":
    from valve_friction_ros.nodes.identifier import node
    from valve_friction_ros.nodes.plumbing import running

    running.arm.__defaults__ = (2.0,)
    running._ANSWER = 2.0
    running._SILENCE = running._AGAIN = 0.5
    lock = ctypes.PyDLL(None).pthread_mutex_lock  # holds Python's lock, as rclpy does
    mutex = ctypes.create_string_buffer(64)

    def freezing(name, method):
        def call(self, *arguments, **named):
            if Path(FREEZE).exists() and Path(FREEZE).read_text() == name:
                lock(mutex)
                lock(mutex)
            return method(self, *arguments, **named)

        return call

    one = node.Identifier
    one.poll = freezing(LOOP, one.poll)
    one.create_publisher = freezing(MIDDLEWARE, one.create_publisher)
    one.destroy_node = freezing(CLEAN_UP, one.destroy_node)
    sys.exit(node.main())
