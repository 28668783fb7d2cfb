"""What cannot be written is refused with its folder; a bug is not blamed on the folder."""

import errno

import pytest

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.output_folder import output_folder


def test_the_folder_that_is_given_or_the_usual_one(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    with output_folder("~/pages", "reports", "a report") as folder:
        assert folder.name == "pages"
        assert folder.is_absolute()
    with output_folder("", "reports", "a report") as folder:
        assert folder == tmp_path / "valve_friction_ros" / "reports"


def test_an_unknown_home_is_refused():
    with (
        pytest.raises(RefusalError, match=r"^cannot write a report into ~nobody-such/x: Could not"),
        output_folder("~nobody-such/x", "reports", "a report"),
    ):
        pytest.fail("there is no such folder")


def test_trouble_with_the_disk_is_refused(tmp_path):
    with (
        pytest.raises(RefusalError, match=f"^cannot write a bag into {tmp_path}: No space left"),
        output_folder(str(tmp_path), "saved", "a bag"),
    ):
        raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("bug", [RuntimeError("a bug"), ValueError("a bug")])
def test_a_bug_is_not_blamed_on_the_folder(tmp_path, bug):
    with (
        pytest.raises(type(bug), match=r"^a bug$"),
        output_folder(str(tmp_path), "reports", "a report"),
    ):
        raise bug
