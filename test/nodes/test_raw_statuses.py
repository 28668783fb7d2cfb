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
    found = [(one.name, one.read()) for one in statuses_in(array(statuses, frame))]
    assert found == [(one.name, status_of(one)) for one in statuses]


@given(st.data())
def test_other_bytes_are_refused(data):
    """A message that ends early, or any bytes: a status, or ValueError, and nothing else."""
    whole = array(data.draw(st.lists(STATUSES, min_size=1, max_size=2)))
    cut = whole[: data.draw(st.integers(0, len(whole)))]
    for message in (cut, data.draw(st.binary(max_size=60)), b"\0\1" + data.draw(st.binary())):
        with contextlib.suppress(ValueError):
            for one in statuses_in(message):
                one.read()


def test_what_ends_within_its_name_is_refused():
    with pytest.raises(ValueError, match="no diagnostics"):
        list(statuses_in(array([DiagnosticStatus(name="a" * 40)])[:30]))


def marks(*statuses):
    return [one.mark for one in statuses_in(array(statuses))]


def said(message="friction normal", age="1.0", ratio="1.02", count="5"):
    pairs = {"friction_ratio": ratio, "estimate_age [s]": age, "buffered_samples": count}
    values = [KeyValue(key=key, value=value) for key, value in pairs.items()]
    return DiagnosticStatus(name="/v/identifier: friction", message=message, values=values)


def test_ages_and_counters_leave_the_mark():
    assert marks(said()) == marks(said(age="2.0", count="7")) != [None]
    assert marks(said()) != marks(said(ratio="1.03"))
    assert marks(said()) != marks(said(message="friction has grown"))
    assert marks(DiagnosticStatus(name="/v/identifier: friction")) == [None]
