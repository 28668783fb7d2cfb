"""The report of one identification: a page from the diagnosis to the settings."""

import math
import time
from collections.abc import Iterator

from valve_friction_ros.figures.report_figures import (
    comparison_figure,
    evidence_figure,
    noise_figures,
    record_figure,
    residual_figure,
    signature_loop_figure,
)
from valve_friction_ros.figures.trend_figure import drift_text, report_trend_figure
from valve_friction_ros.health import percentage
from valve_friction_ros.history import ValveHistory
from valve_friction_ros.history.trend import DAY
from valve_friction_ros.identification import StemComparison
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.reports.diagnosis_sentence import diagnosis_sentence
from valve_friction_ros.reports.identification_tables import (
    budget_table,
    friction_table,
    parameter_table,
    record_table,
    settings_table,
)
from valve_friction_ros.reports.identified_record import IdentifiedRecord
from valve_friction_ros.reports.page import Page, Paragraph, Picture, Section
from valve_friction_ros.reports.published_words import published_words
from valve_friction_ros.reports.response_section import response_section
from valve_friction_ros.reports.usage_section import usage_section
from valve_friction_ros.reports.valve_status import date_line, valve_status
from valve_friction_ros.reports.valve_table import valve_table

__all__ = ["identification_report"]

_VERDICTS = (
    "Identified: half the interval is at most 5 % of the value, and no doubt is known. Weak: the "
    "interval is wider, or the reason stands beside the verdict. Not identifiable: the record does "
    "not determine the parameter, and no value is shown. Fixed: the value was given."
)
_FRICTION = "Friction against its baseline"
_WHOLE_VALVE = "The valve beside its friction"
_NOTHING_ELSE = "Nothing else has surely changed beyond its limit"
_BUDGET = (
    "Where the intervals come from. By the record: its noise, what the model leaves of the motion, "
    "and the imperfections of the valve. By the timing: a lag between the signals. By the "
    "calibration: the scales of diaphragm area and sensors. By other models: what is left of the "
    "interval, for laws of friction that are nearly as probable, or for what a law may leave out. "
    "The 95 % interval is twice the root of the sum of the squares of a row."
)
_ALL_NOISE = 0.05
"""Share of a misfit, below which what is not noise is not told. Chosen: 0.1 % of its square."""

_NO_STEM = (
    "The spring is zero or not identifiable, so the stem cannot be simulated: no force returns it. "
    "This report therefore holds neither a comparison nor a residual."
)


def identification_report(record: IdentifiedRecord) -> Page:
    """Return the page on an identified record: its parameters and the evidence for them.

    The status, the diagnosis in one sentence and the date, then parameters, uncertainty budget,
    friction against its baseline, the other numbers of the valve against theirs, trend, use, the
    answer to the command, the record, the valve signature, the evidence of the method, the measured
    against the simulated position, the residual, notes, settings and versions. Parts that a method
    does not have are left out.
    """
    return Page(
        f"Friction of {record.name}",
        diagnosis_sentence(record),
        tuple(_sections(record)),
        valve_status(record),
        date_line(record),
    )


def _sections(record: IdentifiedRecord) -> Iterator[Section]:
    result = record.result
    words = filter(None, (_VERDICTS, published_words(result)))
    yield Section("Parameters", (parameter_table(record), *map(Paragraph, words)))
    if budget := budget_table(record):
        yield Section("Uncertainty budget", (budget, Paragraph(_BUDGET)))
    yield _friction(record)
    if table := valve_table(record):
        found = [one.message for one in record.findings] or [_NOTHING_ELSE]
        told = (Paragraph(f"{one[0].upper()}{one[1:]}.") for one in found)
        yield Section(_WHOLE_VALVE, (*told, table))
    if record.history is not None:
        yield _trend(record.history)
    if (use := usage_section(record.usage, record.valve, record.usage_limits)) is not None:
        yield use
    if record.response is not None and (answers := response_section(record.response)) is not None:
        yield answers
    yield _record(record)
    yield _signature(record)
    drawing = result.drawing
    if drawing.panels:
        picture = Picture(evidence_figure(drawing), drawing.caption, drawing.alt)
        yield Section(drawing.heading, (picture,))
    comparison = result.stem
    if comparison is None:
        yield Section("Measured and simulated position", (Paragraph(_NO_STEM),))
    else:
        yield _comparison(record, comparison)
        yield _residual(record, comparison)
    notes = (*record.notes, *result.warnings)
    if notes:
        yield Section("Notes", tuple(Paragraph(f"{note}.") for note in notes))
    yield Section("Settings and versions", (settings_table(record),))


def _friction(record: IdentifiedRecord) -> Section:
    table = friction_table(record)
    if record.baseline is None:
        none = Paragraph(
            "Excess friction is unknown, because this valve has no baseline: nothing on this page "
            "says that the valve is healthy. The baseline is the friction of the healthy valve."
        )
        return Section(_FRICTION, (none, table))
    return Section(_FRICTION, (table,))


def _trend(history: ValveHistory) -> Section:
    trend, days = history.trend, len({entry.time // DAY for entry in history.entries})
    size = len(history.entries)
    count = f"{size} identification{'s' * (size > 1)} on {days} day{'s' * (days > 1)}"
    told = f"{count}. No drift is told: that needs the frictions of four days, by one method."
    if trend is not None:
        told = f"{count}. Drift of the {trend.what}: {drift_text(trend)}."
        if not trend.is_significant:
            told += " Its interval holds zero: no drift is proved."
    now = time.time_ns()
    picture = Picture(
        report_trend_figure(history, now),
        "Friction with its 95 % intervals, baseline and limits. Hollow: weak.",
        "Friction of the valve over the time, with baseline and limits.",
        report_trend_figure(history, now, is_narrow=True),
    )
    return Section("Trend", (Paragraph(told), picture))


def _record(record: IdentifiedRecord) -> Section:
    drive = record.recording.driven_by.words
    picture = Picture(
        record_figure(record.recording),
        f"The record: {drive} and stem position over the time.",
        f"Two curves over {record.recording.duration:.3g} s: {drive} above, stem position below.",
    )
    return Section("Record", (picture, record_table(record)))


def _signature(record: IdentifiedRecord) -> Section:
    result, drive = record.result, record.recording.driven_by.words
    caption = f"Stem position over {drive}: the wider the loop, the more friction."
    if record.healthy is not None:
        caption += " Grey: the record of the baseline."
    caption += result.drawing.loop_caption
    picture = Picture(
        signature_loop_figure(result, record.healthy),
        caption,
        f"A loop of stem position over {drive}.",
    )
    return Section("Valve signature", (picture,))


def _comparison(record: IdentifiedRecord, comparison: StemComparison) -> Section:
    result = record.result
    share = record.valve.share_of_travel(result.rms)
    of_travel = f", {percentage(share)} of the travel" if math.isfinite(share) else ""
    picture = Picture(
        comparison_figure(comparison),
        f"The measured stem and, dotted, the stem of the identified model under the same "
        f"{record.recording.driven_by.words}. Fit {100 * result.fit:.2f} %, rms "
        f"{result.rms * 1e6:.3g} µm{of_travel}.",
        "Measured and simulated stem position over the time, in one panel.",
    )
    return Section("Measured and simulated position", (picture,))


def _residual(record: IdentifiedRecord, comparison: StemComparison) -> Section:
    misfit = record.result.misfit
    picture = Picture(
        residual_figure(comparison),
        f"The residual, simulated minus measured position, over the time.{_noise_words(misfit)}",
        "Residual over the time.",
    )
    histogram, correlation = noise_figures(comparison)
    return Section(
        "Residual",
        (
            picture,
            Picture(histogram, "Its histogram.", "Histogram of the residual."),
            Picture(
                correlation,
                "Its autocorrelation. For noise alone it stays within the grey band beyond lag 0.",
                "Autocorrelation of the residual over the lag.",
            ),
        ),
    )


def _noise_words(misfit: Misfit | None) -> str:
    if misfit is None:
        return ""
    if misfit.systematic < _ALL_NOISE * misfit.rms:
        return f" Its {misfit.rms * 1e6:.3g} µm rms are not larger than the noise of the sensors."
    return (
        f" Of {misfit.rms * 1e6:.3g} µm rms, {misfit.systematic * 1e6:.3g} µm are more than noise, "
        f"which {'does not put' if misfit.describes else 'puts'} the model in doubt."
    )
