# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Process that publishes the streams of a benchmark: serialised once, then only stamps change.

It prints how many samples of each signal it has sent to each valve.
"""

import argparse
import struct
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension, MultiArrayLayout

from valve_friction_ros import model
from valve_friction_ros.streams import COLUMNS

_SECOND = 1_000_000_000
_START = int(time.time())
"""Stamp of the first sample, s: the node compares stamps with its clock."""
_TURN = 1e-3
"""Time between two checks for due samples, s."""
_PATIENCE = 300.0
_DEPTH = 20_000
_STAMP = struct.Struct("<iI")
_NUMBER = struct.Struct("<d")
_MARK = 1.2345e67
_BLOCKS_PER_SECOND = 10


def _signals(rate: int) -> tuple[np.ndarray, np.ndarray]:
    """Return ten seconds of two strokes of the bench valve with sensor noise, to repeat.

    The stem rests between them, so that they are moves in service.
    """
    wave = model.SineWave()
    places = [wave.low, wave.high, wave.high, wave.low, wave.low]
    pressure = np.interp(np.arange(10 * rate) / rate, [0.0, 3.0, 5.0, 8.0, 10.0], places)
    stem = model.simulate(model.BENCH_VALVE, model.LOW_FRICTION, pressure, 1 / rate)
    noisy = model.SensorNoise(position=10e-6, pressure=100.0, seed=1).applied_to(
        model.Recording(1 / rate, pressure, stem.position)
    )
    return noisy.pressure, noisy.position


def _sender(publisher: Publisher, message: object) -> Callable[[int, float], None]:
    """Return a function that publishes `message` with a given stamp, ns, and value."""
    raw = bytearray(serialize_message(message))
    at = raw.index(_NUMBER.pack(_MARK))

    def send(stamp: int, value: float) -> None:
        _STAMP.pack_into(raw, 4, *divmod(stamp, _SECOND))
        _NUMBER.pack_into(raw, at, value)
        publisher.publish(bytes(raw))

    return send


def _due(rate: float, count: int) -> Iterator[range]:
    """Yield the numbers of due samples, up to `count`."""
    begin, sent = time.monotonic(), 0
    while sent < count:
        due = min(count, int((time.monotonic() - begin) * rate) + 1)
        yield range(sent, due)
        sent = due
        time.sleep(max(0.0, begin + (sent / rate) - time.monotonic(), _TURN / 10))


def _publish_samples(node: Node, valves: list[str], rate: int, count: int) -> None:
    quality = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.RELIABLE)
    header = Header(frame_id="actuator")
    messages = {
        "actuator_pressure": FluidPressure(header=header, fluid_pressure=_MARK),
        "stem_state": JointState(header=header, name=["stem"], position=[_MARK], velocity=[0.0]),
    }
    publishers = [
        {
            topic: node.create_publisher(type(message), f"/{valve}/{topic}", quality)
            for topic, message in messages.items()
        }
        for valve in valves
    ]
    senders = [
        tuple(_sender(one[topic], message) for topic, message in messages.items())
        for one in publishers
    ]
    pressure, position = (signal.tolist() for signal in _signals(rate))
    _wait_for_readers([publisher for one in publishers for publisher in one.values()])
    period = _SECOND // rate
    at_once = max(1, round(rate * _TURN))
    for due in _due(rate / at_once, count // at_once):
        for sample in range(due.start * at_once, due.stop * at_once):
            stamp, place = _START * _SECOND + sample * period, sample % len(pressure)
            for send_pressure, send_stem in senders:
                send_pressure(stamp, pressure[place])
                send_stem(stamp, position[place])


def _publish_blocks(node: Node, valves: list[str], rate: int, count: int) -> None:
    size = rate // _BLOCKS_PER_SECOND
    quality = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
    publishers = [
        node.create_publisher(Float64MultiArray, f"/{valve}/identifier/samples", quality)
        for valve in valves
    ]
    layout = MultiArrayLayout(
        dim=[
            MultiArrayDimension(label="sample", size=size, stride=3 * size),
            MultiArrayDimension(label=",".join(COLUMNS), size=3, stride=3),
        ]
    )
    message = Float64MultiArray(layout=layout, data=[_MARK] * (3 * size))
    raw = bytearray(serialize_message(message))
    at = raw.index(_NUMBER.pack(_MARK))
    table = np.frombuffer(raw, np.float64, 3 * size, at).reshape(size, 3)
    pressure, position = _signals(rate)
    _wait_for_readers(publishers)
    # The valves take turns, as from a data-acquisition system.
    for due in _due(_BLOCKS_PER_SECOND * len(valves), count // size * len(valves)):
        for number in due:
            first = number // len(valves) * size
            sample = first + np.arange(size)
            table[:, 0] = _START + sample / rate
            table[:, 1] = pressure[sample % pressure.size]
            table[:, 2] = position[sample % position.size]
            publishers[number % len(valves)].publish(bytes(raw))


def _wait_for_readers(publishers: list[Publisher]) -> None:
    deadline = time.monotonic() + _PATIENCE
    while any(publisher.get_subscription_count() == 0 for publisher in publishers):
        if time.monotonic() > deadline:
            raise TimeoutError("no identifier subscribes")
        time.sleep(0.05)


def main() -> int:
    """Publish, then wait until the benchmark has read the buffers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("valves", nargs="+")
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--blocks", action="store_true")
    options = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("stream_source", enable_rosout=False, start_parameter_services=False)
    count = round(options.rate * options.seconds)
    if options.blocks:
        _publish_blocks(node, options.valves, options.rate, count)
    else:
        _publish_samples(node, options.valves, options.rate, count)
    sys.stdout.write(f"{count}\n")
    sys.stdout.flush()
    sys.stdin.read()
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
