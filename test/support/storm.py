# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A publisher of both signals of a valve at a high rate, as a process of its own."""

import argparse
import time

import numpy as np
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from records import LOW_FRICTION, SineWave, converter_response, simulated
from sensor_msgs.msg import FluidPressure, JointState

_BLOCK = 0.005
"""Time that is published at once, s."""


def _serialised(kind, **fields):
    """Return a message's bytes; its stamp is at byte 4."""
    return bytearray(serialize_message(kind(**fields)))


def main():
    """Publish a sine of the bench valve, stamped by the clock, until the time is over."""
    parser = argparse.ArgumentParser()
    parser.add_argument("namespace")
    parser.add_argument("--rate", type=float, default=10_000.0)
    parser.add_argument("--seconds", type=float, default=60.0)
    given = parser.parse_args()
    times = np.arange(round(5 * given.rate)) / given.rate
    record = simulated(
        converter_response(SineWave(period=5.0).sample(times), 1 / given.rate, 0.01),
        1 / given.rate,
        LOW_FRICTION,
    )
    pressures, positions = record.pressure, record.position
    rclpy.init(args=[])
    node = rclpy.create_node("storm")
    quality = QoSProfile(depth=20_000, reliability=ReliabilityPolicy.BEST_EFFORT)
    pressure = node.create_publisher(FluidPressure, f"{given.namespace}/actuator_pressure", quality)
    stem = node.create_publisher(JointState, f"{given.namespace}/stem_state", quality)
    while not (pressure.get_subscription_count() and stem.get_subscription_count()):
        time.sleep(0.05)
    a = _serialised(FluidPressure, fluid_pressure=1.2345e67)
    b = _serialised(JointState, name=["stem"], position=[1.2345e67])
    mark = np.float64(1.2345e67).tobytes()
    at, bt = bytes(a).index(mark), bytes(b).index(mark)
    begun, stamp0, sent = time.monotonic(), time.time_ns(), 0
    while (now := time.monotonic() - begun) < given.seconds:
        due = round(now * given.rate)
        while sent < due:
            stamp = stamp0 + round(sent * 1e9 / given.rate)
            head = np.array([stamp // 10**9, stamp % 10**9], np.uint32).tobytes()
            i = sent % pressures.size
            a[4:12] = b[4:12] = head
            a[at : at + 8] = pressures[i].tobytes()
            b[bt : bt + 8] = positions[i].tobytes()
            pressure.publish(bytes(a))
            stem.publish(bytes(b))
            sent += 1
        time.sleep(_BLOCK)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
