"""Which files and folders count as recordings."""

import os

import pytest

from valve_friction_ros.fleet import find_recordings


@pytest.fixture
def plant(tmp_path):
    for name in (
        "b.csv",
        "a/c.CSV.gz",
        "a/d.mcap",
        "a/e.db3.zstd",
        "a/old.bag",
        "a/t.XLSX",
        "a/u.parquet",
        "a/~$t.XLSX",
        "bag/metadata.yaml",
        "bag/bag_0.mcap",
        "bag/bag_1.mcap",
        "bag/more/inner.csv",
        "lost/x_0.db3",
        "lost/x_1.db3",
        "other/metadata.yaml",
        ".git/hidden.csv",
        "a/.hidden.csv",
        "a/valve.yaml",
        "b.valve.yaml",
        "readme.md",
        "out.csv",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    return tmp_path


def test_what_counts(plant):
    findings = find_recordings(plant, plant / "out.csv")
    assert [found.name for found in findings.recordings] == [
        "a/c.CSV.gz",
        "a/d.mcap",
        "a/e.db3.zstd",
        "a/old.bag",
        "a/t.XLSX",
        "a/u.parquet",
        "b.csv",
        "bag",
        "lost/x_0.db3",
        "lost/x_1.db3",
    ]
    assert findings.skipped == (
        ".git/",
        "a/.hidden.csv",
        "a/~$t.XLSX",
        "other/metadata.yaml",
        "readme.md",
    )
    stems = [found.stem for found in findings.recordings]
    assert stems[:7] == ["c", "d", "e", "old", "t", "u", "b"]


def test_a_bag_that_lost_its_storage_is_a_recording_to_complain_of(tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    (found,) = find_recordings(tmp_path).recordings
    assert found.name == "bag"


def test_the_folder_itself_may_be_a_bag(plant):
    (found,) = find_recordings(plant / "bag").recordings
    assert (found.name, found.stem) == (".", "bag")


def test_names_that_fit_on_no_line_and_links_to_folders_are_skipped(tmp_path):
    (tmp_path / "two\nlines.csv").write_text("")
    (tmp_path / os.fsdecode(b"\xff.csv")).write_text("")
    (tmp_path / "there").symlink_to(tmp_path)
    findings = find_recordings(tmp_path)
    assert findings.recordings == ()
    assert set(findings.skipped) == {"two\nlines.csv", os.fsdecode(b"\xff.csv"), "there/"}


def test_the_fingerprint_tells_changes_of_the_content_only(plant):
    found = {one.name: one for one in find_recordings(plant).recordings}
    states = {name: one.content() for name, one in found.items()}
    (plant / "bag" / "valve.yaml").write_text("diaphragm_area: 1.0")
    (plant / "bag" / "bag_1.mcap").write_text("longer")
    os.utime(plant / "b.csv", ns=(1, 1))
    assert {n for n, one in found.items() if one.content() != states[n]} == {"bag", "b.csv"}
    state = found["bag"].content()
    (plant / "bag" / "valve.yaml").write_text("diaphragm_area: 2.0")
    assert found["bag"].content() == state


def test_no_folder(tmp_path):
    with pytest.raises(ValueError, match="no such folder"):
        find_recordings(tmp_path / "nowhere")
