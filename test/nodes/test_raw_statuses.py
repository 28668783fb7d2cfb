"""Statuses out of serialised diagnostics."""

import contextlib

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import serialize_message

from valve_friction_ros.nodes.dashboard.raw_statuses import status_of, statuses_in

# CDR ends a text with a zero byte, so none is inside; ROS sends UTF-8.
TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=20)
STATUSES = st.builds(
    DiagnosticStatus,
    level=st.binary(min_size=1, max_size=1),
    name=TEXT,
    message=TEXT,
    hardware_id=TEXT,
    values=st.lists(st.builds(KeyValue, key=TEXT, value=TEXT), max_size=5),
)


def array(statuses, frame=""):
    message = DiagnosticArray(status=statuses)
    message.header.frame_id = frame
    return bytes(serialize_message(message))


@given(st.lists(STATUSES, max_size=4), TEXT)
def test_they_are_what_rclpy_reads(statuses, frame):
    found = [(name, read()) for name, read in statuses_in(array(statuses, frame))]
    assert found == [(one.name, status_of(one)) for one in statuses]


@given(st.data())
def test_other_bytes_are_refused(data):
    """A message that ends early, or any bytes: a status, or ValueError, and nothing else."""
    whole = array(data.draw(st.lists(STATUSES, min_size=1, max_size=2)))
    cut = whole[: data.draw(st.integers(0, len(whole)))]
    for message in (cut, data.draw(st.binary(max_size=60)), b"\0\1" + data.draw(st.binary())):
        with contextlib.suppress(ValueError):
            for _, read in statuses_in(message):
                read()


def test_what_ends_within_its_name_is_refused():
    with pytest.raises(ValueError, match="no diagnostics"):
        list(statuses_in(array([DiagnosticStatus(name="a" * 40)])[:30]))
