# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Statuses out of serialised diagnostics."""

import contextlib

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import serialize_message

from valve_friction_ros.nodes.dashboard.node import status_of, statuses_in

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
        with contextlib.suppress(ValueError):
            for one in statuses_in(message):
                one.mark()


def test_what_ends_within_its_name_is_refused():
    with pytest.raises(ValueError, match="no diagnostics"):
        list(statuses_in(array([DiagnosticStatus(name="a" * 40)])[:30]))


def marks(*statuses):
    return [one.mark() for one in statuses_in(array(statuses))]


def said(message="friction normal", age="1.0", ratio="1.02", count="5"):
    pairs = {"friction_ratio": ratio, "estimate_age [s]": age, "buffered_samples": count}
    values = [KeyValue(key=key, value=value) for key, value in pairs.items()]
    return DiagnosticStatus(name="/v/identifier: friction", message=message, values=values)


def test_ages_and_counters_leave_the_mark():
    assert marks(said()) == marks(said(age="2.0", count="7"))
    assert marks(said()) != marks(said(ratio="1.03"))
    assert marks(said()) != marks(said(message="friction has grown"))


def test_a_key_within_another_one_is_none():
    alike = DiagnosticStatus(values=[KeyValue(key="my friction_ratio", value="9")])
    assert marks(alike) == marks(DiagnosticStatus())


def test_each_status_of_an_array_has_its_own_mark():
    empty, known = DiagnosticStatus(), said()
    assert marks(empty, known) == [*marks(empty), *marks(known)]


def test_bytes_between_the_texts_leave_the_mark():
    """The serialiser leaves them as they were in its memory."""
    whole = bytearray(array([said(message="ab")]))  # three bytes and a zero: none is needed
    (before,) = (one.mark() for one in statuses_in(bytes(whole)))
    place = whole.index(b"friction_ratio\0") + len(b"friction_ratio\0")
    assert -place % 4
    whole[place : place + -place % 4] = b"\xee" * (-place % 4)
    (after,) = (one.mark() for one in statuses_in(bytes(whole)))
    assert after == before
