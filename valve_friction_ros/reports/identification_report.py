"""The report of one identification: a page from the diagnosis to the settings."""

import math
from collections.abc import Iterator

from valve_friction_ros.figures.report_figures import (
    comparison_figure,
    evidence_figure,
    record_figure,
    residual_figure,
    signature_loop_figure,
)
from valve_friction_ros.health import percentage
from valve_friction_ros.identification import StemComparison
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

__all__ = ["identification_report"]

_VERDICTS = (
    "Identified: half the interval is at most 5 % of the value, and no doubt is known. Weak: the "
    "interval is wider, or the reason stands beside the verdict. Not identifiable: the record does "
    "not determine the parameter, and no number is shown. Fixed: the value was given."
)
_FRICTION = "Friction against its baseline"
_BUDGET = (
    "Where the intervals come from. By the record: its noise, what the model leaves of the motion, "
    "and the imperfections of the valve. By the timing: a lag between the signals. By the "
    "calibration: the scales of diaphragm area and sensors. The 95 % interval is twice the root of "
    "the sum of their squares, or wider where other models are nearly as probable."
)
_NO_STEM = (
    "The spring is zero or not identifiable, so the stem cannot be simulated: no force returns it. "
    "This report therefore holds neither a comparison nor a residual."
)


def identification_report(record: IdentifiedRecord) -> Page:
    """Return the page on an identified record: its parameters and the evidence for them.

    The diagnosis in one sentence, then parameters, uncertainty budget, friction against its
    baseline, the record, the valve signature, the evidence of the method, the measured against the
    simulated position, the residual, notes, settings and versions. Parts that a method does not
    have are left out.
    """
    return Page(f"Friction of {record.name}", diagnosis_sentence(record), tuple(_sections(record)))


def _sections(record: IdentifiedRecord) -> Iterator[Section]:
    result = record.result
    yield Section("Parameters", (parameter_table(record), Paragraph(_VERDICTS)))
    if budget := budget_table(record):
        yield Section("Uncertainty budget", (budget, Paragraph(_BUDGET)))
    yield _friction(record)
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
            "Excess friction is unknown, because this valve has no baseline. The baseline is the "
            "Coulomb friction of the healthy valve."
        )
        return Section(_FRICTION, (none, table))
    return Section(_FRICTION, (table,))


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
    caption += result.drawing.loop_caption
    picture = Picture(
        signature_loop_figure(result),
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
    caption = (
        "The residual, simulated minus measured position, over the time, its histogram, and its "
        "autocorrelation. For noise alone the autocorrelation stays within the grey band beyond "
        "lag 0."
    )
    if misfit is not None:
        caption += (
            f" Of {misfit.rms * 1e6:.3g} µm rms, {misfit.systematic * 1e6:.3g} µm are not noise, "
            f"which {'does not put' if misfit.describes else 'puts'} the model in doubt."
        )
    picture = Picture(
        residual_figure(comparison),
        caption,
        "Residual over the time; below it its histogram and its autocorrelation.",
    )
    return Section("Residual", (picture,))
