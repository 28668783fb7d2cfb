# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifier, or those of several valves, with a fault, as a node to start.

Files in the node's working directory switch a fault on or off, or let it end.
"""

import ctypes
import resource
import sys
import time
from pathlib import Path

BEGUN = "begun"
"""Tells that an identification has begun."""
FINISH = "finish"
"""Lets an identification, or the writing of a bag, end."""
MENDED = "mended"
"""Takes the fault of `failing` away."""
RAISE = "raise"
"""Names where the bug is: in the loop, in a timer or at the start."""
LOOP, TIMER, BEGINNING = "loop", "timer", "beginning"
FREEZE = "freeze"
"""Names what freezes: the loop, the middleware or the clean-up."""
MIDDLEWARE, CLEAN_UP = "middleware", "clean-up"
BLOCK = "block"
"""The loop stands still as long as it is there."""
FULL, SLOW = "full", "slow"
"""Folder in which no file may grow; and one in which a bag takes until `FINISH` lies beside it."""


def faulty(fault):
    """The script of a node with this fault."""
    return [__file__, fault]


def identifier():
    """The identifier, which identifies in a thread of its own process, and its workers."""
    from valve_friction_ros.nodes.identifier import node, workers

    node._PROCESSES = 0
    return node, workers


def slow():
    """An identification lasts as long as a test wants."""
    node, workers = identifier()
    identify_once = workers.identify_with_numbers

    def identify_again_and_again(*arguments):
        Path(BEGUN).touch()
        while True:
            estimate = identify_once(*arguments)
            if Path(FINISH).exists():
                return estimate

    workers.identify_with_numbers = identify_again_and_again
    return node


def failing():
    """A fault that nobody foresaw in an identification."""
    node, workers = identifier()
    identify = workers.identify_with_numbers

    def identify_or_fail(*arguments):
        if not Path(MENDED).exists():
            raise ZeroDivisionError("nobody\nforesaw it")
        return identify(*arguments)

    workers.identify_with_numbers = identify_or_fail
    return node


def pageless():
    """A fault in what writes the page of a report."""
    from valve_friction_ros import reports

    def fail(*_):
        raise ZeroDivisionError("nobody foresaw it")

    reports.write_identification_report = fail
    return identifier()[0]


def disk_trouble():
    """Some folders lie on a full or a slow disk."""
    from valve_friction_ros.nodes.identifier import node
    from valve_friction_ros.records.bags import writing

    write_bag = writing.write_bag

    def write_bag_to_such_a_disk(folder, *arguments):
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        if folder.name == FULL:
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
        while folder.name == SLOW and not (folder.parent / FINISH).exists():
            time.sleep(0.01)
        try:
            return write_bag(folder, *arguments)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    writing.write_bag = write_bag_to_such_a_disk
    return node


def one_raising():
    """Of several valves fv_102 has bugs."""
    from valve_friction_ros.nodes import identifiers
    from valve_friction_ros.nodes.identifier.node import Identifier

    def raising(name, method):
        def call(self, *arguments):
            is_it = self.get_namespace() == "/fv_102" and Path(RAISE).exists()
            if is_it and Path(RAISE).read_text() == name:
                raise ZeroDivisionError("a bug")
            return method(self, *arguments)

        return call

    Identifier.configure = raising(BEGINNING, Identifier.configure)
    Identifier.poll = raising(LOOP, Identifier.poll)
    Identifier._publish_diagnostics = raising(TIMER, Identifier._publish_diagnostics)
    return identifiers


def frozen():
    """Frozen for good within C."""
    from valve_friction_ros.nodes.identifier import node
    from valve_friction_ros.nodes.plumbing import running

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

    def poll(self):
        running.arm.__defaults__ = (2.0,)  # not before: a start takes longer on a busy machine
        turn(self)

    one = node.Identifier
    turn, one.poll = freezing(LOOP, one.poll), poll
    one.create_publisher = freezing(MIDDLEWARE, one.create_publisher)
    one.destroy_node = freezing(CLEAN_UP, one.destroy_node)
    return node


def stuck():
    """A loop of several valves counts as stuck after 2 s in place of ten."""
    from valve_friction_ros.nodes import identifiers
    from valve_friction_ros.nodes.identifier.node import Identifier
    from valve_friction_ros.nodes.plumbing import running

    poll = Identifier.poll

    def poll_when_free(self):
        while Path(BLOCK).exists():
            time.sleep(0.05)
        poll(self)

    Identifier.poll = poll_when_free
    running.LOOP_LIMIT = 2.0
    return identifiers


if __name__ == "__main__":
    sys.exit(globals()[sys.argv.pop(1)]().main())
