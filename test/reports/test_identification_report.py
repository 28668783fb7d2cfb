"""What stands on the report of an identification, before it becomes a page."""

import dataclasses

import numpy as np
import pytest

from valve_friction_ros.health import Baseline
from valve_friction_ros.identification import StemComparison, Verdict
from valve_friction_ros.identification.published.sweep_drawing import chosen_region
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.reports import (
    Page,
    identification_report,
    require_report_file,
    write_report,
)
from valve_friction_ros.usage import (
    BINS,
    Usage,
    UsageLimits,
    UsedDay,
    ValveUsage,
    limit_states,
)

FRICTION = "Friction against its baseline"


def section(page, title):
    (found,) = (section for section in page.sections if section.title == title)
    return found


def rows(record, title):
    (table,) = (
        block
        for block in section(identification_report(record), title).blocks
        if block.kind == "table"
    )
    return {row[0]: row[1:] for row in table.rows}


def test_excess_friction_has_the_interval_of_both(with_friction):
    """Half widths of 3 and 4 N make one of 5 N."""
    told = rows(with_friction(150.0, 3.0, baseline=Baseline(100.0, 4.0)), FRICTION)
    assert told["friction of the healthy valve (baseline)"] == ("coulomb friction 100 ± 4 N",)
    assert told["excess friction"] == ("+50 N ± 5 N",)
    assert told["friction over baseline"][0].startswith("coulomb friction: 1.50, 95 % interval ")
    assert told["level"] == ("WARN, NE 107 status signal M",)


def test_without_a_baseline_nothing_is_said_of_excess(with_friction):
    record = with_friction(150.0, 3.0)
    assert "excess friction" not in rows(record, FRICTION)
    words = section(identification_report(record), FRICTION).blocks[0].text
    assert words.startswith("Excess friction is unknown, because this valve has no baseline")
    assert "nothing on this page says that the valve is healthy" in words
    assert rows(record, FRICTION)["level"][0].startswith("unknown: nothing was compared")


def test_what_is_not_identifiable_has_no_ratio(with_friction):
    nan = float("nan")
    record = with_friction(
        nan, nan, Verdict.NOT_IDENTIFIABLE, "too short", baseline=Baseline(100.0)
    )
    assert not {"excess friction", "friction over baseline"} & set(rows(record, FRICTION))
    told = rows(record, "Parameters")["Coulomb friction F_c [N]"]
    assert told[:3] == ("–", "–", "not identifiable: too short")


def test_the_time_of_a_record_is_told_where_its_clock_is_that_of_the_world(identified):
    dated = dataclasses.replace(identified.recording, start_time=1.7e9)

    def of(recording):
        result = dataclasses.replace(identified.result, recording=recording)
        return rows(dataclasses.replace(identified, result=result), "Record")

    assert of(dated)["began"] == ("2023-11-14 22:13:20 UTC",)
    assert "began" not in rows(identified, "Record")
    mistaken = dataclasses.replace(identified.recording, start_time=1.7e18)
    assert "began" not in of(mistaken)


def test_what_the_valve_has_done(identified):
    """Since the packing was renewed, and in all; nothing for a valve that was not watched."""
    day = 86_400 * 10**9
    times = (day, *[0] * (BINS - 1))
    days = [UsedDay(n, day * n, Usage(1.5, 10 + n, 4, times)) for n in (1, 2)]
    used = dataclasses.replace(identified, usage=ValveUsage.of(days, renewal=2 * day))
    told = rows(used, "Use")
    assert told["travelled distance [m]"] == ("1.5", "3")
    assert told["reversals"] == ("12", "23")
    assert told["time watched [h]"] == ("24", "48")
    assert told["time near 0 % of the travel [h]"] == ("24", "48")
    assert told["time near 100 % of the travel [h]"] == ("0", "0")
    blocks = section(identification_report(used), "Use").blocks
    assert [block.kind for block in blocks] == ["table", "picture", "paragraph"]
    assert "1.5 m and 12 reversals in a day of watching" in blocks[-1].text
    assert blocks[0].columns[1].title == "since the packing was renewed, 1970-01-03"
    assert "Use" not in [one.title for one in identification_report(identified).sections]


def test_the_limits_of_a_packing(identified):
    """With the date on which each is expected; nothing of them where they are not known."""
    day = 86_400 * 10**9
    days = [UsedDay(n, 0, Usage(1.5, 100, 4, (day, *[0] * (BINS - 1)))) for n in range(2)]
    usage = ValveUsage.of(days)

    def blocks(limits):
        one = dataclasses.replace(identified, usage=usage, usage_limits=limits)
        return section(identification_report(one), "Use").blocks

    limits = UsageLimits(travel=60.0, reversals=1200.0)
    _, table, warning, _, _ = blocks(
        limit_states(usage.since_renewal, usage.pace(), limits, 2 * day)
    )
    assert table.rows == (
        ("travel_limit [m]", "3", "60", "5 %", "1970-02-10"),
        ("reversal_limit [reversals]", "200", "1200", "17 %", "1970-01-13"),
    )
    assert warning.text.startswith("Packing life: 200 reversals of 1200 (reversal_limit), expected")
    assert "renew the packing, then call ~/reset_usage" in warning.text
    reached = limit_states(usage.since_renewal, None, UsageLimits(3.0, 1e6), 2 * day)
    _, table, *_ = blocks(reached)
    assert [row[-1] for row in table.rows] == ["reached", "not known before a day of watching"]
    assert "has no limit: set the parameter travel_limit" in blocks(())[1].text
    assert [block.kind for block in blocks(None)] == ["table", "picture", "paragraph"]


class TestUncertaintyBudget:
    """Of a method whose evidence holds one, whatever its sources are called."""

    @pytest.fixture
    def with_budget(self, with_friction):
        """Function of a budget and settings: the record with them; F_c and k are estimated."""

        def build(budget, **settings):
            record = with_friction(150.0)
            result = dataclasses.replace(
                record.result,
                evidence={"uncertainty_budget": budget},
                derivative_window=0,
                settings=dataclasses.replace(record.result.settings, **settings),
            )
            return dataclasses.replace(record, result=result)

        return build

    def test_a_row_an_estimate_and_a_column_a_source(self, with_budget):
        """What is withheld, as F_s, has no row."""
        budget = {
            "coulomb_friction": {"record": 17.31, "timing": 0.7215},
            "static_friction": {"record": 44.0, "timing": 1.4},
            "spring_constant": {"record": 1381.9, "timing": 0.0},
        }
        (table, words) = section(
            identification_report(with_budget(budget)), "Uncertainty budget"
        ).blocks
        assert [column.title for column in table.columns] == [
            "standard uncertainty",
            "by the record",
            "by the timing",
            "by the calibration",
        ]
        assert table.rows == (
            ("Coulomb friction F_c [N]", "17", "0.72", "0"),
            ("spring constant k [N/m]", "1382", "0", "0"),
        )
        assert words.text.startswith("Where the intervals come from.")

    def test_the_parts_add_up_to_the_interval(self, with_friction):
        """Half a width of 10 is 5, of which 3 leave 4; k has nothing left."""
        budget = {
            "coulomb_friction": {"record": 2.4, "timing": 1.8},
            "spring_constant": {"record": 0.5, "timing": 0.0},
        }
        record = with_friction(150.0, 10.0)
        result = dataclasses.replace(record.result, evidence={"uncertainty_budget": budget})
        (table, words) = section(
            identification_report(dataclasses.replace(record, result=result)), "Uncertainty budget"
        ).blocks
        assert table.columns[-1].title == "by other models"
        told = {row[0]: [float(cell) for cell in row[1:]] for row in table.rows}
        assert told["Coulomb friction F_c [N]"] == [2.4, 1.8, 0.0, 4.0]
        assert told["spring constant k [N/m]"] == [0.5, 0.0, 0.0, 0.0]
        assert "By other models" in words.text

    def test_its_sources_are_those_of_the_method(self, with_budget):
        told = rows(with_budget({"coulomb_friction": {"weather": 2.0}}), "Uncertainty budget")
        assert told == {"Coulomb friction F_c [N]": ("2", "0")}

    def test_a_given_parameter_has_none(self, with_friction):
        record = with_friction(150.0, 0.0, Verdict.FIXED)
        result = dataclasses.replace(
            record.result,
            evidence={
                "uncertainty_budget": {
                    "coulomb_friction": {"record": 1.0},
                    "spring_constant": {"record": 2.0},
                }
            },
        )
        told = rows(dataclasses.replace(record, result=result), "Uncertainty budget")
        assert [*told] == ["spring constant k [N/m]"]

    def test_other_methods_have_none(self, identified):
        titles = [one.title for one in identification_report(identified).sections]
        assert "Uncertainty budget" not in titles
        settings = rows(identified, "Settings and versions")
        assert not [name for name in settings if name.startswith("timing uncertainty")]
        assert settings["derivative window"][0].endswith(
            " samples, chosen from the noise of the record"
        )

    @pytest.mark.parametrize(
        ("given", "told"), [(None, "0.04 s, by default"), (0.0, "0 s, as given")]
    )
    def test_the_timing_that_it_counts_with(self, with_budget, given, told):
        budget = {"coulomb_friction": {"record": 1.0, "timing": 0.5}}
        record = with_budget(budget, timing_uncertainty=given)
        settings = rows(record, "Settings and versions")
        (found,) = (value for name, value in settings.items() if name.startswith("timing"))
        assert found == (told,)
        assert "derivative window" not in settings  # of no samples

    def test_calibration(self, with_friction):
        """It is in the budget, and left out of the comparison, which says so."""
        record = with_friction(150.0, 3.0, baseline=Baseline(100.0, 4.0))
        settings = dataclasses.replace(record.result.settings, area_uncertainty=0.02)
        result = dataclasses.replace(record.result, settings=settings)
        wide = dataclasses.replace(record, result=result)
        assert rows(wide, "Uncertainty budget")["Coulomb friction F_c [N]"] == ("1.5", "3", "0")
        told = rows(wide, "Settings and versions")
        assert told["relative standard uncertainty of the diaphragm area"] == ("2 %",)
        assert not [name for name in told if "sensor" in name or name.startswith("timing")]
        told, before = (rows(one, FRICTION) for one in (wide, record))
        (words,) = told.pop("uncertainty of the calibration")
        assert words.startswith("left out of this comparison: the same area and sensors")
        for name in ("excess friction", "friction over baseline", "level"):
            assert told[name] == before[name]
        assert "uncertainty of the calibration" not in before


@pytest.mark.parametrize(
    ("systematic", "words"),
    [
        (0.0, "Its 9 µm rms are not larger than the noise of the sensors."),
        (3e-6, "Of 9 µm rms, 3 µm are more than noise, which does not put the model in doubt."),
        (5e-6, "Of 9 µm rms, 5 µm are more than noise, which puts the model in doubt."),
    ],
)
def test_what_a_misfit_means(with_friction, systematic, words):
    record = with_friction(150.0, misfit=Misfit(0.99, 9e-6, systematic, 4e-6))
    picture, *_ = section(identification_report(record), "Residual").blocks
    assert picture.caption.endswith(f". {words}")


def test_notes_of_the_record_come_before_those_of_the_estimate(identified):
    warned = dataclasses.replace(identified.result, warnings=("clocks differ",))
    record = dataclasses.replace(identified, result=warned, notes=("cut off",))
    notes = [block.text for block in section(identification_report(record), "Notes").blocks]
    assert notes[:2] == ["cut off.", "clocks differ."]


def test_stated_values_that_the_record_contradicts(identified):
    """The preload of the paper's form is k·x̄; the spring is another one than stated."""
    found = identified.result.values["spring_constant"]
    settings = dataclasses.replace(
        identified.result.settings, stated={"spring_constant": round(found / 3)}
    )
    result = dataclasses.replace(identified.result, settings=settings)
    record = dataclasses.replace(identified, result=result)
    note, *_ = [block.text for block in section(identification_report(record), "Notes").blocks]
    assert note.startswith(f"spring_constant is {found:.6g} N/m by the record and ")
    told = rows(record, "Settings and versions")
    assert told["stated values, compared with those found"] == (
        f"spring_constant = {round(found / 3):g}",
    )
    assert "stated values, compared with those found" not in rows(
        identified, "Settings and versions"
    )


def test_the_region_holds_the_choice_and_ends_where_sigma_leaves_its_tenth(identified):
    sweep = dataclasses.replace(
        identified.result.estimate.sweep,
        thresholds=np.arange(1.0, 8.0),
        sigma=np.array([9.0, 1.2, 1.05, 1.0, 0.95, 0.8, 1.0]),
    )
    assert chosen_region(sweep, 4.0) == (3.0, 5.0)
    assert chosen_region(sweep, 1.0) == (1.0, 1.0)
    assert chosen_region(sweep, 7.0) == (7.0, 7.0)


def test_autocorrelation_of_what_is_known():
    """Two plus and two minus ones after each other: 1, then 1/4 of what was, then −2/4 …."""
    measured = np.zeros(4)
    comparison = StemComparison(0.5, measured, np.array([1.0, 1.0, -1.0, -1.0]))
    assert comparison.time.tolist() == [0.0, 0.5, 1.0, 1.5]
    assert comparison.autocorrelation(4) == pytest.approx([1.0, 0.25, -0.5, -0.25])
    assert StemComparison(0.5, measured, measured).autocorrelation(2).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("report.pdf", "a report is an HTML page: give it a name that ends in .html"),
        ("nowhere/report.html", "there is no folder {folder}/nowhere: create it, or name another"),
        ("folder.html", "this is a folder: give the report another name"),
    ],
)
def test_files_that_are_no_place_for_a_report(tmp_path, name, reason):
    (tmp_path / "folder.html").mkdir()
    path = tmp_path / name
    with pytest.raises(ValueError) as refused:  # noqa: PT011 - the whole message is compared
        require_report_file(path)
    assert str(refused.value) == f"{path}: {reason.format(folder=tmp_path)}"


def test_a_report_that_cannot_be_written_leaves_what_is_at_its_place(tmp_path):
    path = tmp_path / "report.html"
    path.mkdir()
    with pytest.raises(IsADirectoryError):
        write_report(Page("one", "lead", ()), path)
    assert list(tmp_path.iterdir()) == [path]
    path.rmdir()
    path.write_text("before")
    write_report(Page("one", "lead", ()), path)
    assert "<h1>one</h1>" in path.read_text()
    assert list(tmp_path.iterdir()) == [path]
