# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes as processes of their own, and a client that talks to them over DDS."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from extension.diagnostic_keys import is_explained
from processes import PATIENCE
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.duration import Duration
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

from benchmark.harness.processes import parameters as as_arguments
from benchmark.harness.run import Participant

PROJECT = Path(__file__).resolve().parents[2]
NAMESPACE = "/fv_101"
NODE = f"{NAMESPACE}/identifier"
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
"""Levels of a diagnostic."""
_REPEAT = 5.0
"""Time until a service is called again, s."""
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
"""Stamp of the first sample of most records, ns: any time but the present."""

STREAM = QoSProfile(depth=60_000, reliability=ReliabilityPolicy.RELIABLE)
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
_BURST = 400
"""Messages that are published at once; a transport's queue holds 512."""


class Domain:
    """A ROS domain that no other test uses, in this run or another on the same machine.

    An abstract socket of the domain's number is held as long as the domain is in use.
    """

    _last = os.getpid() % 90

    def __init__(self):
        for _ in range(90):
            Domain._last = Domain._last % 90 + 1
            self.number = Domain._last
            self._claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                self._claim.bind(f"\0valve_friction_ros/domain/{self.number}")
            except OSError:
                self._claim.close()
            else:
                return
        raise RuntimeError("all domains are in use")

    def release(self):
        self._claim.close()


class NodeProcess:
    """A node, started as a person would start it; what it keeps goes into the test's folder."""

    def __init__(
        self, name, domain, folder, parameters=None, arguments=(), script=None, namespace=NAMESPACE
    ):
        self.name = f"{namespace or ''}/{name}"
        self._output = folder / f"{name}-{time.monotonic_ns()}.out"
        self._errors = self._output.with_suffix(".err")
        script = ["-m", f"valve_friction_ros.nodes.{name}"] if script is None else script
        what = script if isinstance(script, list) else [str(script)]
        place = [] if namespace is None else ["-r", f"__ns:={namespace}"]
        given = as_arguments(**(parameters or {}))
        command = [sys.executable, *what, "--ros-args", *place, *arguments, *given]
        path = os.pathsep.join(filter(None, [str(PROJECT), os.environ.get("PYTHONPATH")]))
        environment = os.environ | {"ROS_DOMAIN_ID": str(domain.number), "PYTHONPATH": path}
        environment["ROS_HOME"] = str(folder)
        environment.pop("PYTEST_CURRENT_TEST", None)  # NiceGUI behaves otherwise within a test
        with self._output.open("w") as output, self._errors.open("w") as errors:
            self._process = subprocess.Popen(
                command, cwd=folder, env=environment, stdout=output, stderr=errors
            )
        self._has_stopped = False
        self._may_show_tracebacks = False

    @property
    def pid(self):
        return self._process.pid

    @property
    def errors(self):
        return self._errors.read_text()

    @property
    def output(self):
        return self._output.read_text()

    def is_running(self):
        return self._process.poll() is None

    def require_running(self):
        assert self.is_running(), f"{self.name} ended: {self._process.returncode}\n{self.errors}"

    def interrupt(self):
        """Press Ctrl-C."""
        self._process.send_signal(signal.SIGINT)

    def exit_code(self, timeout=PATIENCE):
        """Wait for the end of the process."""
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise AssertionError(f"{self.name} did not end\n{self.errors}") from None

    def forgive_tracebacks(self):
        """Let the node end well though its log holds a traceback, which a test has looked at."""
        self._may_show_tracebacks = True

    def stop(self):
        """Press Ctrl-C; the node must end well, and must never have shown a traceback."""
        if self._has_stopped:
            return
        self.require_running()
        self.interrupt()
        self.require_good_end()

    def require_good_end(self):
        """Wait for the end of an interrupted node, and look at how it ended."""
        code = self.exit_code()
        self._has_stopped = True
        assert self._may_show_tracebacks or "Traceback" not in self.errors, self.errors
        assert code == 0, self.errors

    def kill(self):
        if self.is_running():
            self._process.kill()
            self._process.wait()


class Client(Participant):
    """What people and programs do with the nodes: publish, listen, call, set parameters."""

    def __init__(self, domain):
        super().__init__("tester", domain.number)
        self._callers = {}
        self.watched = []
        self.statuses = []
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        self._pressure = self._stem = None

    # Waiting

    def wait_until(self, condition, what, timeout=PATIENCE):
        """Spin until `condition()` is true, and return it; the watched processes must live."""
        deadline = time.monotonic() + timeout
        while not (met := condition()):
            for process in self.watched:
                process.require_running()
            assert time.monotonic() < deadline, f"not within {timeout:g} s: {what}"
            self._executor.spin_once(timeout_sec=0.02)
        return met

    def drain(self, seconds=0.5):
        """Take what nodes that have ended have left under way."""
        self.spin(seconds)

    def call(self, kind, name, request):
        """Call a service and return its response.

        A node that has not met a new client yet answers it in vain, so what can be asked twice
        without harm is asked again.
        """
        if kind is Trigger:
            return self.wait_until_answered(self.request(kind, name, request), name)
        pending, deadline = [], time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            pending.append(self.request(kind, name, request))
            again = time.monotonic() + _REPEAT
            while time.monotonic() < again:
                self._executor.spin_once(timeout_sec=0.02)
                for future in pending:
                    if future.done():
                        return future.result()
        raise AssertionError(f"not within {PATIENCE:g} s: answer of {name}")

    def request(self, kind, name, request):
        """Call a service and return the future of its response."""
        if name not in self._callers:
            self._callers[name] = self.node.create_client(kind, name)
        caller = self._callers[name]
        self.wait_until(caller.service_is_ready, f"service {name}")
        return caller.call_async(request)

    def wait_until_answered(self, future, what="an answer"):
        self.wait_until(future.done, f"answer of {what}")
        return future.result()

    # The identifier's services

    def trigger(self, service, node=NODE):
        return self.call(Trigger, f"{node}/{service}", Trigger.Request())

    def success(self, service, node=NODE):
        """Call a service that must do its work; its message."""
        response = self.trigger(service, node)
        assert response.success, response.message
        return response.message

    def refusal(self, service, node=NODE):
        """Call a service that must refuse; its reason."""
        response = self.trigger(service, node)
        assert not response.success, response.message
        return response.message

    def identify_all(self, count):
        """Identify until the buffer held exactly `count` samples of both signals; the response.

        What has been acknowledged waits in the queue of the node, which takes all of it before it
        identifies: the first time is the last, unless an executor of rclpy takes the samples.
        """

        self.wait_for_acknowledgement()

        def answered():
            before = len(self.statuses)
            response = self.trigger("identify")
            self.wait_until(lambda: len(self.statuses) > before, "the diagnostic")
            are_all = all(buffered(status) == count for _, status in self.statuses[before:])
            return response if are_all else None

        try:
            return self.wait_until(answered, f"{count} samples in the buffer")
        except AssertionError as error:
            raise AssertionError(f"{error}; the last was {self.statuses[-1:]}") from None

    def identified_whole(self, count):
        """Identify `count` samples of both signals; the message."""
        response = self.identify_all(count)
        assert response.success, response.message
        return response.message

    def empty_the_buffer(self):
        """Clear the buffer until nothing comes from a test before any more."""

        def is_empty():
            assert self.trigger("clear").success
            before = len(self.statuses)
            self.trigger("identify")
            self.wait_until(lambda: len(self.statuses) > before, "the diagnostic")
            return self.last_values()["buffered_samples"] == "0"

        self.wait_until(is_empty, "an empty buffer")

    def identified(self, record, start=START):
        """Clear the buffer, publish a short record and identify all of it; the message."""
        assert self.trigger("clear").success
        self.send_record(record, start)
        return self.identified_whole(2 * len(record))

    def set_baseline(self, record):
        """Identify a record, and set its friction as the baseline."""
        self.identified(record)
        assert self.trigger("set_baseline").success

    def fill(self, record):
        """Publish a record, and wait until all of it is in the empty buffer."""
        self.send_record(record)
        self.wait_for_buffered(2 * len(record))

    # Diagnostics

    def _on_diagnostics(self, message):
        self.statuses += [(message.header.stamp, status) for status in message.status]

    def next_status(self, condition=lambda _: True, what="a diagnostic"):
        """Wait for a diagnostic, published from now on, that meets `condition(status)`."""
        seen = len(self.statuses)

        def met():
            return next((s for _, s in self.statuses[seen:] if condition(s)), None)

        try:
            return self.wait_until(met, what)
        except AssertionError as error:
            raise AssertionError(f"{error}; the last was {self.statuses[-1:]}") from None

    def last_values(self):
        """Values of the newest diagnostic."""
        return values_of(self.statuses[-1][1])

    def status_values(self, condition=lambda _: True, what="a diagnostic"):
        return values_of(self.next_status(condition, what))

    def wait_for_buffered(self, count):
        """Wait until the identifier's buffer holds exactly `count` samples of both signals."""
        self.next_status(
            lambda status: values_of(status)["buffered_samples"] == str(count),
            f"buffered_samples {count}",
        )

    # Topics

    def listen(self, kind, topic, qos=LATCHED):
        """Subscribe; return the list that received messages are appended to."""
        received = []
        self.node.create_subscription(kind, topic, received.append, qos)
        return received

    def latched(self, kind, topic):
        """Return the last message of a latched topic, as a late subscriber gets it."""
        received = []
        subscription = self.node.create_subscription(kind, topic, received.append, LATCHED)
        self.wait_until(lambda: received, f"a message on {topic}")
        self.node.destroy_subscription(subscription)
        return received[-1]

    def friction(self, *names):
        """Return the latched results of these names."""
        topic = f"{NODE}/friction/"
        return {name: self.latched(Float64, topic + name).data for name in names}

    def half_widths(self, *names):
        """Return the latched half widths of the intervals of these parameters."""
        topic = f"{NODE}/half_width/"
        return {name: self.latched(Float64, topic + name).data for name in names}

    def published(self, *names):
        """Return the latched results of the published method."""
        topic = f"{NODE}/published/"
        return {name: self.latched(Float64, topic + name).data for name in names}

    def sweep(self):
        """Return the latched sweep as a table and the labels of its columns."""
        message = self.latched(Float64MultiArray, f"{NODE}/sweep")
        rows, columns = message.layout.dim
        table = np.array(message.data).reshape(rows.size, columns.size)
        return message.layout, dict(zip(columns.label.split(","), table.T, strict=True))

    def connect(self, readers=1, qos=STREAM):
        """Create the publishers of pressure and stem, and wait until the nodes take them."""
        self._pressure = self.node.create_publisher(
            FluidPressure, f"{NAMESPACE}/actuator_pressure", qos
        )
        self._stem = self.node.create_publisher(JointState, f"{NAMESPACE}/stem_state", qos)
        self.wait_until(
            lambda: all(
                publisher.get_subscription_count() >= readers
                for publisher in (self._pressure, self._stem)
            ),
            "subscriptions of the node",
        )

    def disconnect(self):
        """Destroy the publishers of pressure and stem."""
        for publisher in (self._pressure, self._stem):
            self.node.destroy_publisher(publisher)
        self._pressure = self._stem = None

    def connect_pressure(self):
        """Create the publisher of the pressure alone, and wait until a node takes it."""
        self._pressure = self.node.create_publisher(
            FluidPressure, f"{NAMESPACE}/actuator_pressure", STREAM
        )
        self.wait_until(self._pressure.get_subscription_count, "a subscription to the pressure")

    def send_pressure(self, stamp, pressure):
        message = FluidPressure(fluid_pressure=float(pressure))
        message.header.stamp = time_of(stamp)
        self._pressure.publish(message)

    def send_stem(self, stamp, position):
        self.send_joints(stamp, name=["stem"], position=[float(position)])

    def send_joints(self, stamp, **fields):
        message = JointState(**fields)
        message.header.stamp = time_of(stamp)
        self._stem.publish(message)

    def send(self, pressure=None, position=None):
        """Publish samples (stamps, values) of either signal or both, in the order of time.

        They go in bursts that no queue of the transport is overrun by, each once the one before
        has been acknowledged.
        """
        events = sorted(
            (int(stamp), publish is self.send_stem, float(value), publish)
            for publish, samples in ((self.send_pressure, pressure), (self.send_stem, position))
            if samples is not None
            for stamp, value in zip(*samples, strict=True)
        )
        for begin in range(0, len(events), _BURST):
            for stamp, _, value, publish in events[begin : begin + _BURST]:
                publish(stamp, value)
            self.wait_for_acknowledgement()

    def wait_for_acknowledgement(self):
        """Wait until the nodes have received all samples that were published."""
        for publisher in filter(None, (self._pressure, self._stem)):
            assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE)), "not acknowledged"

    def send_record(self, record, start=START):
        """Publish both signals of `record` at its own stamps, the first at `start` ns."""
        stamps = stamps_of(record, start)
        self.send((stamps, record.pressure), (stamps, record.position))

    # Parameters

    def parameter_names(self, node):
        response = self.call(ListParameters, f"{node}/list_parameters", ListParameters.Request())
        return list(response.result.names)

    def describe(self, node, names):
        request = DescribeParameters.Request(names=names)
        return self.call(DescribeParameters, f"{node}/describe_parameters", request).descriptors

    def parameters(self, node, *names):
        request = GetParameters.Request(names=names)
        response = self.call(GetParameters, f"{node}/get_parameters", request)
        return [parameter_value_to_python(value) for value in response.values]

    def set_parameters(self, node, values):
        """Set parameters one after the other; return the results."""
        request = SetParameters.Request(parameters=_parameter_messages(values))
        return self.call(SetParameters, f"{node}/set_parameters", request).results

    def set_together(self, node, values):
        """Set parameters all at once; return the result."""
        request = SetParametersAtomically.Request(parameters=_parameter_messages(values))
        name = f"{node}/set_parameters_atomically"
        return self.call(SetParametersAtomically, name, request).result


class SimulatedClock:
    """The time on /clock; `now` is the last that it has shown, ns."""

    def __init__(self, client):
        self._client, self.now = client, 0
        self.publisher = client.node.create_publisher(Clock, "/clock", STREAM)

    def show(self, now):
        self.now = now
        self.publisher.publish(Clock(clock=time_of(now)))

    def run_until(self, condition, what, step=SECOND // 20):
        """Let the time run until `condition()` is true; with no step it stands still."""

        def met():
            self.show(self.now + step)
            return condition()

        return self._client.wait_until(met, what)


def _parameter_messages(values):
    return [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]


def time_of(stamp):
    seconds, nanoseconds = divmod(int(stamp), SECOND)
    return Time(sec=seconds, nanosec=nanoseconds)


def stamp_of(time_message):
    return time_message.sec * SECOND + time_message.nanosec


def values_of(status):
    """Values of a diagnostic by key; the reference explains each key that any test meets."""
    values = {entry.key: entry.value for entry in status.values}
    strange = [key for key in values if not is_explained(key)]
    assert not strange, f"doc/extension/meanings.yaml does not explain {strange}"
    return values


def buffered(status):
    return int(values_of(status)["buffered_samples"])


def stamps_of(record, start=START):
    period = round(record.sample_period * SECOND)
    return start + period * np.arange(len(record), dtype=np.int64)
