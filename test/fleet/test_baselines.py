"""Baselines of many valves, from an earlier output or written by hand."""

import pytest

from valve_friction_ros.fleet import read_baselines
from valve_friction_ros.health import Baseline, Measured, SlidingFriction

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
    assert found.count(["bag", "refused.csv"]) == 1


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
