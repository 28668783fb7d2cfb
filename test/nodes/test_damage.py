"""What neither a stranger's bytes nor a bug in one place may end."""

import pytest
import raising_identifier
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
    words = (
        f"{topic}: 100 % of its samples are rejected, no sample was usable yet: they are damaged"
    )
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


def test_a_bug_in_the_loop_is_said_and_the_node_lives_on(live, tmp_path):
    process = started(live, tmp_path, LOOP)
    process.forgive_tracebacks()
    status = live.client.next_status(lambda one: "a bug" in one.message, "the bug")
    assert "internal error: ZeroDivisionError: a bug" in status.message
    assert process.errors.count("Traceback") == 1  # not at each turn
    (tmp_path / raising_identifier.RAISE).unlink()
    live.client.next_status(lambda one: "a bug" not in one.message, "its end")
    assert values_of(status)


def test_a_bug_in_a_timer_ends_the_process_though_its_worker_is_busy(live, tmp_path):
    process = started(live, tmp_path, TIMER)
    live.client.watched.clear()
    live.nodes.remove(process)
    try:
        assert process.exit_code() == 1
    finally:
        process.kill()
    assert "ZeroDivisionError: a bug" in process.errors
