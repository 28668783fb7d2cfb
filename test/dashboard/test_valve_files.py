# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files are offered from the folders that the dashboard knows, and from nowhere else."""

import pytest

from valve_friction_ros.dashboard import DashboardOptions
from valve_friction_ros.dashboard.context import ValveFiles

NAMED = "fv_101_20260921T141320Z"


@pytest.fixture
def files(tmp_path):
    for kind in ("reports", "saved", "alarms"):
        (tmp_path / kind).mkdir()
    (tmp_path / "reports" / f"{NAMED}.html").write_text("<p>")
    (tmp_path / "reports" / f"fv_101_2_{NAMED[7:]}.html").write_text("another valve's")
    bag = tmp_path / "saved" / NAMED
    bag.mkdir()
    (bag / "data.mcap").write_bytes(b"12345")
    (bag / "secret.key").write_text("no part of a bag")
    alarm = tmp_path / "alarms" / f"alarm_{NAMED}_WARN"
    alarm.mkdir()
    (alarm / "report.html").write_text("<p>")
    (tmp_path / "history.sqlite").write_text("")
    return ValveFiles.of(
        DashboardOptions(
            reports=tmp_path / "reports", bags=tmp_path / "saved", alarms=tmp_path / "alarms"
        )
    )


def test_the_files_of_a_valve(files):
    offered = {(one.kind, one.path) for one in files.offered("/fv_101")}
    assert offered == {
        ("reports", f"{NAMED}.html"),
        ("bags", f"{NAMED}/data.mcap"),
        ("alarms", f"alarm_{NAMED}_WARN/report.html"),
    }
    assert all(files.found(kind, path) for kind, path in offered)
    assert files.offered("/fv_102") == []


def test_valves_whose_files_have_the_same_names_are_named():
    others = ["/a/b", "/a_b", "/a_b/", "/a/c", "/", "/a_b"]
    assert ValveFiles.sharing("/a/b", others) == ("/a_b", "/a_b/")
    assert ValveFiles.sharing("/a/c", others) == ()


@pytest.mark.parametrize(
    "path",
    [
        "../history.sqlite",
        "/etc/passwd",
        "..",
        "",
        f"{NAMED}/secret.key",
        "a\0b",
        NAMED,
        "x" * 5000,
    ],
)
def test_nothing_else_is_found(files, path):
    for kind in ("reports", "bags", "alarms", "elsewhere", ".."):
        assert files.found(kind, path) is None


def test_a_link_does_not_lead_out(files, tmp_path):
    secret = tmp_path / "secret.html"
    secret.write_text("x")
    (tmp_path / "reports" / "fv_101_20270101T000000Z.html").symlink_to(secret)
    assert files.found("reports", "fv_101_20270101T000000Z.html") is None


def test_a_name_from_outside_is_printable(files, tmp_path):
    (tmp_path / "reports" / f"{NAMED}\x1b[31m.html").write_text("")
    assert all(one.label.isprintable() for one in files.offered("/fv_101"))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"port": 0}, "port 0"),
        ({"silence": 0.0}, "silence"),
        ({"time_zone": "Mars/Olympus"}, "time_zone"),
        ({"time_zone": "../../etc/passwd"}, "time_zone"),
    ],
)
def test_impossible_options_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        DashboardOptions(**changes)
