# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Which files are recordings, and the baselines of their valves."""

import os

import pytest

from valve_friction_ros.fleet import find_recordings, read_baselines
from valve_friction_ros.health import Baseline, Measured, SlidingFriction


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


@pytest.mark.parametrize(
    "row", ["FV-101.PV\t2026-03-02T10:00:00.0{}Z\t1.25\tGood", '"0{}.5";"1.25"', "{} 1.5"]
)
def test_a_text_with_numbers_is_a_recording(tmp_path, row):
    (tmp_path / "dump.txt").write_text("\n".join(row.format(number) for number in range(9)))
    (tmp_path / "notes.txt").write_text("Stroked on 2 March.\nFV-101: 5 bar, slow.\nSee page 3\n")
    findings = find_recordings(tmp_path)
    assert [one.name for one in findings.recordings] == ["dump.txt"]
    assert findings.skipped == ("notes.txt",)


def test_a_database_is_left_out_with_what_a_killed_process_leaves_beside_it(tmp_path):
    for name in ("all.sqlite", "all.sqlite-wal", "all.sqlite-shm", "notes.txt"):
        (tmp_path / name).touch()
    assert find_recordings(tmp_path, tmp_path / "all.sqlite").skipped == ("notes.txt",)


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


OUTPUT = """\
recording,valve,coulomb_friction_n,coulomb_friction_half_width_n,coulomb_friction_verdict,\
sliding_friction_n,sliding_friction_half_width_n,sliding_speed_m_per_s
unit_1/a.csv,,600,12,identified,800,20,0.005
unit_1/b.csv,,600,120,weak,800,20,0.005
bag,/fv_101,300,,weak,,,
bag,/fv_102,300,6,identified,,,
refused.csv,,,,,,,
'=1.csv,,50,1,identified,,,
"""


def written(folder, text):
    path = folder / "healthy.csv"
    path.write_text(text)
    return path


def test_an_earlier_output(tmp_path):
    """Each friction counts that is known well enough; one without an interval is not."""
    found = read_baselines(written(tmp_path, OUTPUT))
    slid = SlidingFriction(800.0, 20.0, 0.005)
    assert found.of("unit_1/a.csv") == {"": Baseline(600.0, 12.0, slid)}
    assert found.of("unit_1/b.csv") == {"": Baseline(sliding=slid)}
    assert found.of("bag") == {"/fv_102": Baseline(300.0, 6.0)}
    assert found.of("=1.csv") == {"": Baseline(50.0, 1.0)}
    assert found.of("refused.csv") == found.of("elsewhere.csv") == {}


def test_what_else_an_earlier_output_says_of_the_valve(tmp_path):
    """Numbers with intervals count, where the spring constant is known well."""
    names = "spring_constant_n_per_m,spring_constant_half_width_n_per_m,"
    names += "spring_preload_n,spring_preload_half_width_n,viscous_friction_n_s_per_m"
    rows = "a.csv,600,2e5,1e3,500,20,5e3\nb.csv,600,2e5,3e4,500,20,5e3\n"
    found = read_baselines(written(tmp_path, f"recording,coulomb_friction_n,{names}\n{rows}"))
    assert found.of("a.csv")[""].numbers == {
        "spring_constant": Measured(2e5, 1e3),
        "spring_preload": Measured(500.0, 20.0),
    }
    assert found.of("b.csv")[""].numbers == {}


def test_written_by_hand(tmp_path):
    """A value alone is exact; without a recording it is of its valve in every recording."""
    text = "recording,valve,coulomb_friction_n\na.csv,,600\n,/fv_101,300\n"
    found = read_baselines(written(tmp_path, text))
    assert found.of("a.csv") == {"": Baseline(600.0), "/fv_101": Baseline(300.0)}
    assert found.of("bag_7") == {"/fv_101": Baseline(300.0)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,position_m\n0,1\n", "give a CSV file of identify-folder"),
        (
            "recording,coulomb_friction_n\na.csv,many\n",
            "row 2: column 'coulomb_friction_n': 'many' is not a number",
        ),
        ("recording,coulomb_friction_n\na.csv,1\na.csv,2\n", "row 3: a second baseline of a.csv"),
        ("recording,coulomb_friction_n\na.csv,-5\n", "no friction in it is known well enough"),
    ],
)
def test_refused(tmp_path, text, message):
    path = written(tmp_path, text)
    with pytest.raises(ValueError, match=r"healthy\.csv: ") as refusal:
        read_baselines(path)
    assert message in str(refusal.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(ValueError, match=r"none\.csv: cannot be read: No such file"):
        read_baselines(tmp_path / "none.csv")
