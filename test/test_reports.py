# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reports: the diagnosis in one sentence, the page of an identification, and its rendering."""

import base64
import dataclasses
import math
import struct

import numpy as np
import pytest
from matplotlib.figure import Figure
from pages import PageReader

from valve_friction_ros.health import Baseline, FrictionLimits, Level
from valve_friction_ros.identification import (
    IdentificationSettings,
    Parameter,
    StemComparison,
    Verdict,
    identify_bench,
)
from valve_friction_ros.identification.published.sweep import chosen_region
from valve_friction_ros.identification.trust.verdict import Misfit
from valve_friction_ros.model import BENCH_VALVE, Recording, SensorNoise, SineWave, simulate
from valve_friction_ros.reports import (
    Colour,
    Column,
    Conclusion,
    IdentifiedRecord,
    Page,
    PageTable,
    Paragraph,
    Picture,
    Section,
    diagnosis_sentence,
    identification_report,
    render,
    require_report_file,
    write_report,
)
from valve_friction_ros.reports.page import Verbatim, typeset
from valve_friction_ros.usage import BINS, Usage, UsageLimits, UsedDay, ValveUsage, limit_states


@pytest.fixture(scope="session")
def identified(benches):
    """Four strokes at 100 Hz, with a little noise on both sensors."""
    pressure = SineWave(period=4.0).sample(np.arange(800) / 100)
    position = simulate(BENCH_VALVE, benches["low"].parameters, pressure, 0.01).position
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=1)
    recording = noise.applied_to(Recording(0.01, pressure, position))
    settings = IdentificationSettings(position_bias=1.13e-3)
    result = identify_bench(recording, BENCH_VALVE, settings)
    return IdentifiedRecord("FV-101", "a test", result)


@pytest.fixture(scope="session")
def with_friction(identified):
    """Function of F_c, half width and verdict: the record, with k 2e5 N/m and F_s unknown."""

    def parameter(name, value, half_width, verdict, reason):
        return Parameter(name, value, half_width / 2, half_width, verdict, reason)

    def build(value, half_width=1.0, verdict=Verdict.IDENTIFIED, reason="", **changes):
        unknown = Verdict.NOT_IDENTIFIABLE
        parameters = {
            **identified.result.parameters,
            "coulomb_friction": parameter("coulomb_friction", value, half_width, verdict, reason),
            "static_friction": parameter("static_friction", NAN, NAN, unknown, "hidden"),
            "spring_constant": parameter("spring_constant", 2e5, 1.0, Verdict.IDENTIFIED, ""),
        }
        if verdict is unknown:
            parameters["sliding_friction"] = parameter("sliding_friction", NAN, NAN, unknown, "")
        misfit = changes.pop("misfit", identified.result.misfit)
        record = of_result(identified, parameters=parameters, misfit=misfit)
        return dataclasses.replace(record, **changes)

    return build


BASELINE = Baseline(100.0)
NAN = float("nan")
# 2 F_c/k = F_c · 1e-5 m of 28.575 mm: 0.035 % for each newton.


def ratio_told(value, share):
    """The ratio with the interval of a relative half width of `share`, as the sentence has it."""
    low, high = value * math.exp(-share), value * math.exp(share)
    return f"{value:.2f} times that of the healthy valve (95 % interval: {low:.2f} to {high:.2f})"


LONGER = "before any work, identify it again from a longer record"


@pytest.mark.parametrize(
    ("friction", "share", "word", "effect", "advice"),
    [
        (400.0, 0.01, "is excessive", "14 %", "replace the packing as soon as possible"),
        (150.0, 0.02, "has grown", "5.2 %", "plan to replace the packing at the next shutdown"),
        (30.0, 0.01, "has collapsed", "1 %", "check the packing for leakage now"),
        (70.0, 0.01, "has fallen", "2.4 %", "check the packing for leakage on the next round"),
        (102.0, 0.02, "is normal", "3.6 %", "no action is needed"),
        (150.0, 0.5, "may have changed", "5.2 %", LONGER),
        (75.0, 0.4, "may have changed", "2.6 %", LONGER),
    ],
)
def test_against_a_baseline(with_friction, friction, share, word, effect, advice):
    told = diagnosis_sentence(with_friction(friction, share * friction, baseline=BASELINE))
    assert told.startswith(advice.capitalize())
    assert f". The friction {word}, {ratio_told(friction / 100.0, share)}. The stem" in told
    assert f" reversals smaller than {effect} of its travel." in told


def test_limits_are_those_of_the_record(with_friction):
    narrow = FrictionLimits(warn_ratio=1.01, error_ratio=1.05)
    record = with_friction(110.0, baseline=BASELINE, limits=narrow)
    assert ". The friction is excessive, 1.10 times" in diagnosis_sentence(record)


def test_without_a_baseline(with_friction):
    told = diagnosis_sentence(with_friction(152.7, 1.2))
    assert told == (
        "Set a baseline, the friction of the healthy valve, to see whether it grows. The friction "
        "is 152.7 ± 1.2 N. The stem ignores reversals smaller than 5.3 % of its travel."
    )


def test_a_weak_or_a_given_number_is_called_so(with_friction):
    weak = with_friction(400.0, 30.0, Verdict.WEAK, "two strokes only", baseline=BASELINE)
    assert ". This value is weak: two strokes only. The stem" in diagnosis_sentence(weak)
    given = with_friction(150.0, 0.0, Verdict.FIXED, "given")
    assert ". The friction is 150 N. It was given, not identified. The stem" in diagnosis_sentence(
        given
    )


def test_what_is_not_identifiable_has_no_number(with_friction):
    record = with_friction(NAN, NAN, Verdict.NOT_IDENTIFIABLE, "too few strokes", baseline=BASELINE)
    assert diagnosis_sentence(record) == (
        "Stroke the valve quickly several times in both directions and identify it again. "
        "This record does not determine the friction (too few strokes)."
    )


def test_an_impossible_friction_names_the_signals(with_friction):
    assert diagnosis_sentence(with_friction(-20.0, baseline=BASELINE)) == (
        "Check the direction of both signals, and identify it again. The identified friction is "
        "-20 N, but friction cannot be negative."
    )


def test_a_model_that_does_not_describe_the_valve_comes_first(with_friction, identified):
    misfit = dataclasses.replace(identified.result.misfit, systematic=40e-6, tolerated=10e-6)
    doubt = (
        "Use this with caution, because the model does not describe this valve (40 µm of the "
        "stem's motion remain unexplained). "
    )
    normal = with_friction(100.0, baseline=BASELINE, misfit=misfit)
    assert normal.diagnosis.level is Level.OK
    assert diagnosis_sentence(normal).startswith(
        f"{doubt}Check the sensors and their mounting, then identify it again. The friction is "
        "normal, "
    )
    excessive = with_friction(400.0, baseline=BASELINE, misfit=misfit)
    assert diagnosis_sentence(excessive).startswith(f"{doubt}Replace the packing")


@pytest.mark.parametrize(
    ("friction", "baseline", "status"),
    [
        (150.0, None, (Colour.GREY, "Unknown", "no baseline to compare the friction with")),
        (100.0, BASELINE, (Colour.GREEN, "Friction normal")),
        (150.0, BASELINE, (Colour.AMBER, "Friction has grown", "maintenance required (NE 107: M)")),
        (500.0, BASELINE, (Colour.RED, "Excess friction")),
    ],
)
def test_the_colour_of_the_status_is_that_of_the_diagnosis(
    with_friction, friction, baseline, status
):
    found = identification_report(with_friction(friction, baseline=baseline)).status
    assert found[: len(status)] == status


FRICTION = "Friction compared with its baseline"


def of_result(record, **changes):
    """The record with another result."""
    return dataclasses.replace(record, result=dataclasses.replace(record.result, **changes))


def blocks(record, title):
    """The blocks of a section of its report."""
    (found,) = (one for one in identification_report(record).sections if one.title == title)
    return found.blocks


def rows(record, title):
    (table,) = (block for block in blocks(record, title) if block.kind == "table")
    return {row[0]: row[1:] for row in table.rows}


def test_excess_friction_has_the_interval_of_both(with_friction):
    """Half widths of 3 and 4 N make one of 5 N."""
    told = rows(with_friction(150.0, 3.0, baseline=Baseline(100.0, 4.0)), FRICTION)
    assert told["friction of the healthy valve (baseline)"] == ("Coulomb friction 100.0 ± 4.0 N",)
    assert told["excess friction"] == ("+50.0 ± 5.0 N",)
    assert told["friction ratio to baseline"][0].startswith(
        "Coulomb friction: 1.50, 95 % interval: "
    )
    assert told["level"] == ("WARN, NE 107 status signal M",)


def test_without_a_baseline_nothing_is_said_of_excess(with_friction):
    record = with_friction(150.0, 3.0)
    assert "excess friction" not in rows(record, FRICTION)
    words = blocks(record, FRICTION)[0].text
    assert words.startswith(
        "Whether friction is excessive is unknown, because this valve has no baseline"
    )
    assert "nothing on this page says that the valve is healthy" in words
    assert rows(record, FRICTION)["level"][0].startswith("unknown: nothing was compared")


def test_what_is_not_identifiable_has_no_ratio(with_friction):
    record = with_friction(NAN, NAN, Verdict.NOT_IDENTIFIABLE, "too short", baseline=BASELINE)
    assert not {"excess friction", "friction ratio to baseline"} & set(rows(record, FRICTION))
    told = rows(record, "Parameters")["Coulomb friction F_c [N]"]
    assert told[:3] == ("–", "–", "not identifiable: too short")


def test_the_time_of_a_record_is_told_where_its_clock_is_that_of_the_world(identified):
    def begun_at(time):
        recording = dataclasses.replace(identified.recording, start_time=time)
        return rows(of_result(identified, recording=recording), "Record")

    assert begun_at(1.7e9)["began"] == ("2023-11-14 22:13:20 UTC",)
    assert "began" not in rows(identified, "Record")
    assert "began" not in begun_at(1.7e18)


def test_what_the_valve_has_done(identified):
    """Since the packing was renewed, and in all; nothing for a valve that was not watched."""
    day = 86_400 * 10**9
    times = (day, *[0] * (BINS - 1))
    days = [UsedDay(n, day * n, Usage(1.5, 10 + n, 4, times)) for n in (1, 2)]
    used = dataclasses.replace(identified, usage=ValveUsage.of(days, renewal=2 * day))
    told = rows(used, "Use")
    assert told["travelled distance [m]"] == ("1.5", "3")
    assert told["reversals"] == ("12", "23")
    assert told["time monitored [h]"] == ("24", "48")
    assert told["time near 0 % of the travel [h]"] == ("24", "48")
    assert told["time near 100 % of the travel [h]"] == ("0", "0")
    table, picture, words = blocks(used, "Use")
    assert picture.kind == "picture"
    assert "1.5 m and 12 reversals per day monitored" in words.text
    assert table.columns[1].title == "since the packing was renewed, 1970-01-03"
    assert "Use" not in [one.title for one in identification_report(identified).sections]


def test_the_limits_of_a_packing(identified):
    """With the date on which each is expected; nothing of them where they are not known."""
    day = 86_400 * 10**9
    days = [UsedDay(n, 0, Usage(1.5, 100, 4, (day, *[0] * (BINS - 1)))) for n in range(2)]
    usage = ValveUsage.of(days)

    def told(limits):
        return blocks(dataclasses.replace(identified, usage=usage, usage_limits=limits), "Use")

    limits = UsageLimits(travel=60.0, reversals=1200.0)
    _, table, warning, _, _ = told(limit_states(usage.since_renewal, usage.pace(), limits, 2 * day))
    assert table.rows == (
        ("travel_limit [m]", "3", "60", "5 %", "1970-02-10"),
        ("reversal_limit [reversals]", "200", "1200", "17 %", "1970-01-13"),
    )
    assert warning.text.startswith("Packing life: 200 of 1200 reversals (reversal_limit), expected")
    assert "replace the packing, then call ~/reset_usage" in warning.text
    reached = limit_states(usage.since_renewal, None, UsageLimits(3.0, 1e6), 2 * day)
    _, table, *_ = told(reached)
    assert [row[-1] for row in table.rows] == ["reached", "not known before a day of monitoring"]
    assert "has no limit: set the parameter travel_limit" in told(())[1].text
    assert [block.kind for block in told(None)] == ["table", "picture", "paragraph"]


class TestUncertaintyBudget:
    """Of a method whose evidence holds one, whatever its sources are called."""

    @pytest.fixture
    def with_budget(self, with_friction):
        """Function of a budget and settings: the record with them; F_c and k are estimated."""

        def build(budget, *friction, **settings):
            record = with_friction(*friction or (150.0,))
            changed = dataclasses.replace(record.result.settings, **settings)
            evidence = {"uncertainty_budget": budget}
            return of_result(record, evidence=evidence, derivative_window=0, settings=changed)

        return build

    def test_a_row_an_estimate_and_a_column_a_source(self, with_budget):
        """What is withheld, as F_s, has no row."""
        budget = {
            "coulomb_friction": {"record": 17.31, "weather": 0.7215},
            "static_friction": {"record": 44.0, "weather": 1.4},
            "spring_constant": {"record": 1381.9, "weather": 0.0},
        }
        (table, words) = blocks(with_budget(budget), "Uncertainty budget")
        assert [column.title for column in table.columns] == [
            "standard uncertainty",
            "from record",
            "from weather",
            "from calibration",
        ]
        assert table.rows == (
            ("Coulomb friction F_c [N]", "17", "0.72", "0"),
            ("spring constant k [N/m]", "1382", "0", "0"),
        )
        assert words.text.startswith("Sources of the interval widths.")

    def test_the_parts_add_up_to_the_interval(self, with_budget):
        """Half a width of 10 is 5, of which 3 leave 4; k has nothing left."""
        budget = {
            "coulomb_friction": {"record": 2.4, "timing": 1.8},
            "spring_constant": {"record": 0.5, "timing": 0.0},
        }
        (table, words) = blocks(with_budget(budget, 150.0, 10.0), "Uncertainty budget")
        assert table.columns[-1].title == "from other models"
        told = {row[0]: [float(cell) for cell in row[1:]] for row in table.rows}
        assert told["Coulomb friction F_c [N]"] == [2.4, 1.8, 0.0, 4.0]
        assert told["spring constant k [N/m]"] == [0.5, 0.0, 0.0, 0.0]
        assert "From other models" in words.text

    def test_a_given_parameter_has_none(self, with_budget):
        budget = {"coulomb_friction": {"record": 1.0}, "spring_constant": {"record": 2.0}}
        told = rows(with_budget(budget, 150.0, 0.0, Verdict.FIXED), "Uncertainty budget")
        assert [*told] == ["spring constant k [N/m]"]

    def test_other_methods_have_none(self, identified):
        record = of_result(identified, evidence={}, derivative_window=31)
        report = identification_report(record)
        assert "Uncertainty budget" not in [one.title for one in report.sections]
        settings = rows(record, "Settings and versions")
        assert not [name for name in settings if name.startswith("timing uncertainty")]
        assert settings["derivative window"][0].endswith(
            " samples, chosen from the noise of the record"
        )

    @pytest.mark.parametrize(
        ("given", "told"), [(None, "0 s, by default"), (5e-3, "0.005 s, as given")]
    )
    def test_the_timing_that_it_counts_with(self, with_budget, given, told):
        budget = {"coulomb_friction": {"record": 1.0, "timing": 0.5}}
        settings = rows(with_budget(budget, timing_uncertainty=given), "Settings and versions")
        (found,) = (value for name, value in settings.items() if name.startswith("timing"))
        assert found == (told,)
        assert "derivative window" not in settings  # of no samples

    def test_calibration(self, with_friction):
        """It is in the budget, and left out of the comparison, which says so."""
        record = with_friction(150.0, 3.0, baseline=Baseline(100.0, 4.0))
        settings = dataclasses.replace(record.result.settings, area_uncertainty=0.02)
        wide = of_result(record, settings=settings)
        _, _, calibration, _ = rows(wide, "Uncertainty budget")["Coulomb friction F_c [N]"]
        assert calibration == "3"
        told = rows(wide, "Settings and versions")
        assert told["relative standard uncertainty of the diaphragm area"] == ("2 %",)
        assert not [name for name in told if "sensor" in name]
        told, before = (rows(one, FRICTION) for one in (wide, record))
        (words,) = told.pop("calibration uncertainty")
        assert words.startswith("left out of this comparison: the same area and sensors")
        for name in ("excess friction", "friction ratio to baseline", "level"):
            assert told[name] == before[name]
        assert "calibration uncertainty" not in before


@pytest.mark.parametrize(
    ("systematic", "words"),
    [
        (0.0, "Its 9 µm rms does not exceed the noise of the sensors."),
        (3e-6, "Of 9 µm rms, 3 µm is more than noise, which does not put the model in doubt."),
        (5e-6, "Of 9 µm rms, 5 µm is more than noise, which puts the model in doubt."),
    ],
)
def test_what_a_misfit_means(with_friction, systematic, words):
    record = with_friction(150.0, misfit=Misfit(0.99, 9e-6, systematic, 4e-6))
    picture, *_ = blocks(record, "Residual")
    assert picture.caption.endswith(f". {words}")


def test_notes_of_the_record_come_before_those_of_the_estimate(identified):
    warned = of_result(identified, warnings=("clocks differ",))
    notes = [
        block.text for block in blocks(dataclasses.replace(warned, notes=("cut off",)), "Notes")
    ]
    assert notes[:2] == ["cut off.", "clocks differ."]


def test_stated_values_that_the_record_contradicts(identified):
    """The preload of the paper's form is k·x̄; the spring is another one than stated."""
    found = identified.result.values["spring_constant"]
    settings = dataclasses.replace(
        identified.result.settings, stated={"spring_constant": round(found / 3)}
    )
    record = of_result(identified, settings=settings)
    note, *_ = blocks(record, "Notes")
    assert note.text.startswith(
        f"spring_constant is {found:.6g} N/m from the record but stated as "
    )
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
        (
            "nowhere/report.html",
            "there is no folder {folder}/nowhere: create it, or choose another",
        ),
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


def picture(width=2):
    figure = Figure(figsize=(width, 1))
    figure.subplots().plot([0, 1])
    return Picture(figure, "Fig. <1>", 'a "line"')


TABLE = PageTable(
    (Column("name"), Column("F_c [N]", is_number=True)),
    (("low & slow", "152.7"), ("high", "606")),
    "friction",
    marked=(1,),
)
PAGE = Page(
    "Valve <FV-101>",
    "It </p> sticks & slips.",
    (
        Section("One", (Paragraph("<script>alert(1)</script>"), TABLE)),
        Section("Two", (picture(),)),
    ),
)


@pytest.fixture(scope="module")
def reader():
    return PageReader(render(PAGE))


def test_everything_is_there_and_escaped(reader):
    assert reader.said("h1") == ["Valve <FV-101>"]
    assert reader.said("title") == ["Valve <FV-101>"]
    assert reader.said("h2") == ["One", "Two"]
    assert reader.said("p") == ["It </p> sticks & slips.", "<script>alert(1)</script>"]
    assert reader.said("caption") == ["friction"]
    assert reader.said("th") == ["name", "F_c [N]"]
    assert reader.said("td") == ["low & slow", "152.7", "high", "606"]
    assert reader.said("figcaption") == ["Fig. <1>"]
    assert not reader.of("script")


def test_numbers_stand_at_the_right_and_marked_rows_are_marked(reader):
    assert [cell.get("class") for cell in reader.of("td")] == [None, "number"] * 2
    assert [row.get("class") for row in reader.of("tr")] == [None, None, "marked"]


def test_the_picture_is_in_the_page(reader):
    (image,) = reader.of("img")
    assert image["alt"] == 'a "line"'
    kind, _, data = image["src"].partition(",")
    assert kind == "data:image/png;base64"
    content = base64.b64decode(data, validate=True)
    assert content.startswith(b"\x89PNG")
    assert size(content) == (300, 150)


def size(png):
    return struct.unpack(">II", png[16:24])


@pytest.mark.parametrize(
    ("width", "narrow", "kind"),
    [(3.5, None, "half"), (7.0, (740, 200), None), (9.5, None, None)],
)
def test_a_wide_picture_is_laid_out_again_for_a_narrow_screen(width, narrow, kind):
    """Unless two stand beside each other anyway, or it holds many panels."""
    shown = picture(width)
    reader = PageReader(render(Page("t", "l", (Section("s", (shown,)),))))
    assert [one.get("class") for one in reader.of("figure")] == [kind]
    found = [base64.b64decode(one["srcset"].partition(",")[2]) for one in reader.of("source")]
    assert [size(png) for png in found] == ([] if narrow is None else [narrow])
    assert all("max-width" in one["media"] for one in reader.of("source"))
    assert size(shown.png) == (round(150 * width), 150)


def test_a_table_tells_each_cell_what_it_is():
    """A narrow screen shows the cells of a row below each other, each with its heading."""
    columns = tuple(map(Column, ("a", "b", "F_c")))
    wide, pairs = PageTable(columns, (("1", "2", "3"),)), PageTable(columns[:2], (("1", "2"),))
    reader = PageReader(render(Page("t", "l", (Section("s", (wide, pairs)),))))
    assert [one.get("class") for one in reader.of("table")] == ["cards", None]
    assert [one["data-title"] for one in reader.of("td")] == ["a", "b", "F_c", "a", "b"]
    assert "content: attr(data-title)" in reader.text


@pytest.mark.parametrize("colour", Colour)
def test_the_status_comes_first_with_a_sign_beside_its_colour(colour):
    page = Page("t", "lead", (), Conclusion(colour, "Words <1>", "NE 107"), "2026-11-22")
    reader = PageReader(render(page))
    assert reader.status == (colour.name.lower(), colour.value, "Words <1>", "NE 107")
    assert reader.lead == "lead"
    assert reader.said("p") == ["lead", "2026-11-22"]
    assert len({one.value for one in Colour}) == len(Colour)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("F_c and (F_c + F_s)/k", "F<sub>c</sub> and (F<sub>c</sub> + F<sub>s</sub>)/k"),
        ("P_ref, σ_s, R²_s", "P<sub>ref</sub>, σ<sub>s</sub>, R²<sub>s</sub>"),
        ("F_0 is -20.5 N, -3 to 4", "F<sub>0</sub> is −20.5 N, −3 to 4"),
        ("2026-11-22, FV-101, 1e-05", "2026-11-22, FV-101, 1e-05"),
        ("F_c.csv, sliding_friction, warn_ratio", "F_c.csv, sliding_friction, warn_ratio"),
        ("a < b", "a &lt; b"),
        (Verbatim("F_c <-1>"), "F_c &lt;-1&gt;"),
    ],
)
def test_symbols_and_signs_are_those_of_print(text, shown):
    assert str(typeset(text)) == shown


def test_nothing_is_fetched(reader):
    text = render(PAGE)
    assert "http" not in text
    assert "url(" not in text
    assert "@import" not in text
    for _, attributes in reader.tags:
        for name in ("src", "href"):
            assert attributes.get(name, "#").startswith(("#", "data:"))


@pytest.mark.parametrize(("count", "links"), [(3, 0), (4, 4)])
def test_long_pages_have_contents_that_lead_somewhere(count, links):
    sections = tuple(Section(f"part {i}", ()) for i in range(count))
    reader = PageReader(render(Page("t", "l", sections)))
    places = {f"#{attributes['id']}" for attributes in reader.of("section")}
    assert len(reader.of("a")) == links
    assert {attributes["href"] for attributes in reader.of("a")} <= places
