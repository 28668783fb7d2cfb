# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Quality of service of all topics."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For results: a late subscriber receives the last message."""

REQUESTS = QoSProfile(depth=100)
"""For requests to a service, ten times as deep as usual: they wait for the next turn of the
executor."""


def stream() -> QoSProfile:
    """Return the quality of service of a sensor stream.

    It is deep enough for 20 s at 1 kHz while the receiver is busy. Every topic needs its own
    profile, because rclpy writes the overrides of a topic into it.
    """
    return QoSProfile(depth=20_000)


def blocks() -> QoSProfile:
    """Return the quality of service of a stream of blocks: deep enough for 100 s at 10 Hz."""
    return QoSProfile(depth=1_000)


def statuses() -> QoSProfile:
    """Return the quality of service of the diagnostics of a plant, which are soon replaced.

    It is deep enough for 4 s of 500 valves while the receiver is busy. The middleware never frees
    the memory of its longest queue: at the depth of a stream that is 100 MB.
    """
    return QoSProfile(depth=2_000)


def watched() -> QoSProfile:
    """Return the quality of service of a displayed stream.

    It matches publishers of either reliability and never blocks them.
    """
    return QoSProfile(depth=5_000, reliability=ReliabilityPolicy.BEST_EFFORT)


def qos_overrides() -> QoSOverridingOptions:
    """Let parameters ``qos_overrides.…`` override history, depth and reliability."""
    return QoSOverridingOptions.with_default_policies()
