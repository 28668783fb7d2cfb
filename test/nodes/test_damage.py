# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What neither a stranger's bytes nor a bug in one place may end."""

import pytest
import raising_identifier
from diagnostic_msgs.msg import DiagnosticStatus
from live_nodes import NAMESPACE, values_of
from raising_identifier import LOOP, TIMER
from records import quick_record
from sensor_msgs.msg import FluidPressure, JointState

DAMAGED = b"\x00\x01\x00\x00xx"


@pytest.mark.parametrize(
    ("kind", "topic"), [(JointState, "stem_state"), (FluidPressure, "actuator_pressure")]
)
def test_a_damaged_message_costs_only_itself(live, kind, topic):
    process = live.start_identifier()
    client = live.client
    stranger = client.node.create_publisher(kind, f"{NAMESPACE}/{topic}", 10)
    client.wait_until(lambda: stranger.get_subscription_count() > 0, "the identifier")
    stranger.publish(DAMAGED)
    told = "100 % of its samples are rejected, no sample has been usable yet: they are damaged"
    words = f"{topic}: {told}"
    client.wait_until(lambda: words in process.errors, "the warning")
    record = quick_record()
    client.send_record(record)
    client.wait_for_buffered(2 * len(record))
    assert client.trigger("identify").success
    client.node.destroy_publisher(stranger)


def started(live, tmp_path, where):
    process = live.start("identifier", script=raising_identifier.SCRIPT)
    live.client.next_status()
    (tmp_path / "draft").write_text(where)
    (tmp_path / "draft").rename(tmp_path / raising_identifier.RAISE)
    return process


@pytest.mark.parametrize("where", [LOOP, TIMER])
def test_a_bug_is_an_error_and_the_node_lives_on(live, tmp_path, where):
    process = started(live, tmp_path, where)
    process.forgive_tracebacks()
    status = live.client.next_status(lambda one: "a bug" in one.message, "the bug")
    assert status.level == b"\x02"
    assert status.message.startswith("internal error: ZeroDivisionError: a bug")
    assert values_of(status)["NE 107"] == "C"
    live.client.next_status()
    assert process.errors.count("Traceback") == 1  # not at each turn
    (tmp_path / raising_identifier.RAISE).unlink()
    status = live.client.next_status(lambda one: "a bug" not in one.message, "its end")
    assert status.level < b"\x02"


class TestOneOfSeveral:
    """A valve that fails among three of one process; the others are identified as ever."""

    def start(self, live, tmp_path, faulty, script=None):
        config = tmp_path / "valves.yaml"
        config.write_text(
            "/**:\n  ros__parameters:\n    input_timeout: 600.0\n    method: bench\n"
            "/identifiers:\n  ros__parameters:\n    valves: [fv_101, fv_102, fv_103]\n" + faulty
        )
        arguments = ["--params-file", str(config)]
        process = live.start("identifiers", arguments=arguments, script=script, namespace=None)
        live.client.connect()
        return process

    def statuses(self, client):
        """The next status of each valve."""
        seen = len(client.statuses)

        def met():
            found = {one.name: one for _, one in client.statuses[seen:]}
            return found if len(found) == 3 else None

        return client.wait_until(met, "a status of each valve")

    def require_others(self, client, statuses):
        for name in ("/fv_101/identifier: friction", "/fv_103/identifier: friction"):
            assert statuses[name].level == b"\x00", statuses[name]
        assert client.trigger("clear").success
        client.send_record(quick_record())
        client.next_status(
            lambda one: (
                one.name.startswith(NAMESPACE)
                and values_of(one)["buffered_samples"] == str(2 * len(quick_record()))
            ),
            "all samples of the first valve",
        )
        answer = client.trigger("identify")
        assert answer.success, answer.message

    def test_that_cannot_start(self, live, tmp_path):
        faulty = "/fv_102/identifier:\n  ros__parameters: {travel: -1.0, valve_tag: FV-102}\n"
        process = self.start(live, tmp_path, faulty)
        found = self.statuses(live.client)
        status, told = found["/fv_102/identifier: friction"], "travel must be above zero, got -1"
        assert (status.level, status.hardware_id) == (b"\x02", "FV-102")
        assert status.message == f"cannot start, so nobody watches this valve: {told}"
        assert values_of(status)["NE 107"] == "C"
        assert live.client.latched(DiagnosticStatus, "/fv_102/identifier/estimate") == status
        (line,) = (one for one in process.errors.splitlines() if "cannot start" in one)
        assert f"cannot start /fv_102/identifier: {told}: correct it" in line
        self.require_others(live.client, found)
        assert "/fv_102/identifier/identify" not in dict(
            live.client.node.get_service_names_and_types()
        )

    def test_that_fails_while_it_runs(self, live, tmp_path):
        """At its start already, then in its diagnostics; each time the others go on."""
        script = raising_identifier.SEVERAL
        process = self.start(live, tmp_path, "", script)
        process.forgive_tracebacks()
        self.require_others(live.client, self.statuses(live.client))
        for where in (LOOP, TIMER):
            (tmp_path / "draft").write_text(where)
            (tmp_path / "draft").rename(tmp_path / raising_identifier.RAISE)
            status = live.client.next_status(lambda one: "a bug" in one.message, "the bug")
            assert status.name == "/fv_102/identifier: friction"
            assert status.level == b"\x02"
            self.require_others(live.client, self.statuses(live.client))
        (tmp_path / raising_identifier.RAISE).unlink()
        live.client.next_status(
            lambda one: one.name.startswith("/fv_102") and one.level < b"\x02", "its end"
        )

    def test_a_bug_at_the_start(self, live, tmp_path):
        (tmp_path / raising_identifier.RAISE).write_text(raising_identifier.BEGINNING)
        process = self.start(live, tmp_path, "", raising_identifier.SEVERAL)
        process.forgive_tracebacks()
        found = self.statuses(live.client)
        status = found["/fv_102/identifier: friction"]
        assert status.level == b"\x02"
        assert "nobody watches this valve: internal error: ZeroDivisionError" in status.message
        self.require_others(live.client, found)

    def test_none_can_start(self, live, tmp_path):
        process = self.start_alone(live, tmp_path)
        assert process.exit_code() == 2
        (line,) = process.errors.splitlines()
        told = "identifier: travel must be above zero, got -1"
        assert line == f"cannot start: {'; '.join(f'/fv_10{n}/{told}' for n in (1, 2, 3))}"

    def start_alone(self, live, tmp_path):
        config = tmp_path / "valves.yaml"
        config.write_text(
            "/**:\n  ros__parameters:\n    travel: -1.0\n"
            "/identifiers:\n  ros__parameters:\n    valves: [fv_101, fv_102, fv_103]\n"
        )
        arguments = ["--params-file", str(config)]
        process = live.start("identifiers", arguments=arguments, namespace=None)
        live.client.watched.clear()
        live.nodes.remove(process)
        return process
