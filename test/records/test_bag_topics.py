# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Which topics are a valve's."""

import pytest

from valve_friction_ros.records.bags.topics import (
    PRESSURE_TYPE,
    STEM_TYPE,
    Topic,
    TopicChoice,
    valves_in,
)


def topics(pressures, stems):
    return [
        *(Topic(name, PRESSURE_TYPE) for name in pressures),
        *(Topic(name, STEM_TYPE) for name in stems),
        Topic("/rosout", "rcl_interfaces/msg/Log"),
    ]


def found(pressures, stems, **choice):
    return [tuple(valve) for valve in valves_in(topics(pressures, stems), TopicChoice(**choice))]


@pytest.mark.parametrize(
    ("pressure", "stem", "name"),
    [
        ("/fv/actuator_pressure", "/fv/stem_state", "/fv"),
        ("/p", "/x", "/"),
        ("/a/b/p", "/a/b/x", "/a/b"),
        ("/plant/pressures/fv", "/plant/stems/fv", "/plant"),
        ("/plant/fv/p", "/joint_states", "/"),
    ],
)
def test_one_of_each_is_a_valve_wherever_they_are(pressure, stem, name):
    assert found([pressure], [stem]) == [(name, pressure, stem)]


def test_one_of_each_in_a_namespace():
    assert found(["/b/p", "/a/p"], ["/a/x", "/b/y"]) == [
        ("/a", "/a/p", "/a/x"),
        ("/b", "/b/p", "/b/y"),
    ]


def test_the_names_of_this_package_go_first():
    pressures = ["/a/supply", "/a/actuator_pressure", "/b/actuator_pressure"]
    assert found(pressures, ["/a/stem_state", "/a/arm", "/b/stem_state"]) == [
        ("/a", "/a/actuator_pressure", "/a/stem_state"),
        ("/b", "/b/actuator_pressure", "/b/stem_state"),
    ]


@pytest.mark.parametrize(
    ("pressures", "stems", "option"),
    [
        (["/a/supply", "/a/chamber"], ["/a/x"], "--pressure-topic"),
        (["/a/p"], ["/a/x", "/a/y"], "--stem-topic"),
        (["/a/p", "/b/p"], ["/a/x", "/a/y", "/b/x"], "--stem-topic"),
    ],
)
def test_several_are_named_and_not_guessed_among(pressures, stems, option):
    with pytest.raises(ValueError, match=f": choose one by {option}$"):
        found(pressures, stems)


def test_half_a_valve_is_told_by_its_name():
    assert found(
        ["/a/p", "/b/actuator_pressure", "/weather/air"], ["/a/x", "/arm/joint_states"]
    ) == [
        ("/a", "/a/p", "/a/x"),
        ("/b", "/b/actuator_pressure", None),
    ]


def test_no_pair_at_all():
    with pytest.raises(ValueError, match="no namespace holds both a pressure and a stem, of /a/p"):
        found(["/a/p", "/b/p"], ["/joint_states"])
    chosen = found(["/a/p", "/b/p"], ["/joint_states"], pressure="/b/p")
    assert chosen == [("/", "/b/p", "/joint_states")]


def test_names_within_each_namespace():
    pressures = ["/a/io/p", "/a/p", "/b/io/p"]
    assert found(pressures, ["/a/x", "/b/x"], pressure="io/p") == [
        ("/a", "/a/io/p", "/a/x"),
        ("/b", "/b/io/p", "/b/x"),
    ]


def test_many_topics_are_not_all_listed():
    many = [Topic(f"/t{number:02}", "std_msgs/msg/Float64") for number in range(15)]
    with pytest.raises(ValueError, match=r"/t11 \(std_msgs/msg/Float64\) and 3 more: record"):
        valves_in(many, TopicChoice())
