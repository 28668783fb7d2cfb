# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The report of an identification: one page from the diagnosis to the settings."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from valve_friction_ros.figures.history_figures import report_trend_figure, usage_figure
from valve_friction_ros.figures.record_figures import (
    comparison_figure,
    evidence_figure,
    noise_figures,
    record_figure,
    residual_figure,
    signature_loop_figure,
)
from valve_friction_ros.history import ValveHistory, drift_text
from valve_friction_ros.identification.result import StemComparison
from valve_friction_ros.identification.trust.verdict import Misfit
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.reports.identification_tables import (
    budget_table,
    friction_table,
    parameter_table,
    published_words,
    record_table,
    settings_table,
    valve_table,
)
from valve_friction_ros.reports.identified_record import (
    IdentifiedRecord,
    date_line,
    diagnosis_sentence,
    valve_status,
)
from valve_friction_ros.reports.page import (
    Column,
    Page,
    PageTable,
    Paragraph,
    Picture,
    Section,
    write_report,
)
from valve_friction_ros.response import SIZES, ResponseSummary, Spread, StepAnswer
from valve_friction_ros.streams import DAY, utc, utc_day
from valve_friction_ros.usage import LimitState, Usage, ValveUsage
from valve_friction_ros.wording import capitalised, member_words, numbered, percentage

_VERDICTS = (
    "Identified: half the interval is at most 5 % of the value, and nothing casts doubt on it. "
    "Weak: the interval is wider, or there is a doubt, which is given beside the verdict. Not "
    "identifiable: the record does not determine the parameter, and no value is shown. Fixed: the "
    "value was given."
)
_FRICTION = "Friction compared with its baseline"
_WHOLE_VALVE = "Other changes in the valve"
_NOTHING_ELSE = "Nothing else has changed significantly"
_BUDGET = (
    "Sources of the interval widths. From record: noise, motion that the model does not explain, "
    "and imperfections of the valve. From timing: lag between the signals. From calibration: "
    "scales of diaphragm area and sensors. From other models: the remainder, for laws of friction "
    "that are nearly as probable and for effects that a law may omit. The 95 % interval is twice "
    "the root of the sum of the squares of a row."
)
_ALL_NOISE = 0.05
"""Share of the misfit below which its systematic part is not mentioned. Chosen."""

_NO_STEM = (
    "The spring is zero or not identifiable, so the stem cannot be simulated: no force returns it. "
    "This report therefore holds neither a comparison nor a residual."
)


def identification_report(record: IdentifiedRecord) -> Page:
    """Return the page on an identified record: its parameters and their evidence.

    The page begins with status, diagnosis in one sentence, and date. Sections follow: parameters,
    uncertainty budget, friction and other numbers of the valve compared with the baseline, trend,
    use, response to the command, record, valve signature, evidence of the method, measured and
    simulated position, residual, notes, settings and versions. Sections without content are left
    out.
    """
    return Page(
        f"Friction of {record.name}",
        diagnosis_sentence(record),
        tuple(_sections(record)),
        valve_status(record),
        date_line(record),
    )


def write_identification_report(path: Path, facts: Mapping[str, Any]) -> None:
    """Write the page on an `IdentifiedRecord`, given by its attributes, to a file.

    Raises OSError if it cannot be written.
    """
    write_report(identification_report(IdentifiedRecord(**facts)), path)


def _sections(record: IdentifiedRecord) -> Iterator[Section]:
    result = record.result
    words = filter(None, (_VERDICTS, published_words(result)))
    yield Section("Parameters", (parameter_table(record), *map(Paragraph, words)))
    if budget := budget_table(record):
        yield Section("Uncertainty budget", (budget, Paragraph(_BUDGET)))
    yield _friction(record)
    if table := valve_table(record):
        found = [one.message for one in record.findings] or [_NOTHING_ELSE]
        told = (Paragraph(f"{capitalised(one)}.") for one in found)
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
            "Whether friction is excessive is unknown, because this valve has no baseline: nothing "
            "on this page says that the valve is healthy. The baseline is the friction of the "
            "healthy valve."
        )
        return Section(_FRICTION, (none, table))
    return Section(_FRICTION, (table,))


def _trend(history: ValveHistory) -> Section:
    trend, days = history.trend, len({entry.time // DAY for entry in history.entries})
    size = len(history.entries)
    count = f"{numbered(size, 'identification')} on {numbered(days, 'day')}"
    told = f"{count}. No drift yet: it needs friction from four days or more, by one method."
    if trend is not None:
        told = f"{count}. Drift of the {trend.what}: {drift_text(trend)}."
        if not trend.is_significant:
            told += " Its interval includes zero, so the drift is not significant."
    now = time.time_ns()
    picture = Picture(
        report_trend_figure(history, now),
        "Friction with its 95 % intervals, baseline and limits. Hollow: weak.",
        "Friction of the valve over time, with baseline and limits.",
        report_trend_figure(history, now, is_narrow=True),
    )
    return Section("Trend", (Paragraph(told), picture))


def _record(record: IdentifiedRecord) -> Section:
    drive = record.recording.driven_by.words
    picture = Picture(
        record_figure(record.recording),
        f"The record: {drive} and stem position over time.",
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
        "Measured and simulated stem position over time, in one panel.",
    )
    return Section("Measured and simulated position", (picture,))


def _residual(record: IdentifiedRecord, comparison: StemComparison) -> Section:
    misfit = record.result.misfit
    picture = Picture(
        residual_figure(comparison),
        f"The residual, simulated minus measured position, over time.{_noise_words(misfit)}",
        "Residual over time.",
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
        return f" Its {misfit.rms * 1e6:.3g} µm rms does not exceed the noise of the sensors."
    return (
        f" Of {misfit.rms * 1e6:.3g} µm rms, {misfit.systematic * 1e6:.3g} µm is more than noise, "
        f"which {'does not put' if misfit.describes else 'puts'} the model in doubt."
    )


_MEANING = (
    "A stroke is counted only if it exceeds the counting dead band, so noise is not counted. A "
    "breakaway is a start after a rest of one second or more. Time that was not monitored is not "
    "included anywhere."
)


_UNITS = {"travel_limit": "m", "reversal_limit": "reversals"}
_NO_LIMIT = (
    "The packing life has no limit: set the parameter travel_limit or reversal_limit to be warned "
    "a month ahead."
)


def usage_section(
    usage: ValveUsage, valve: Valve, limits: Sequence[LimitState] | None = None
) -> Section | None:
    """Return table and figure of the usage, since the renewal of the packing and in total.

    With `limits`, add each limit of the packing and when it is expected to be reached. Return None
    for a valve that was not monitored.
    """
    used, everything = usage.since_renewal, usage.total
    if not everything.time_watched:
        return None
    since = "since the first sample"
    if usage.renewal:
        date = utc(usage.renewal)
        since = f"since the packing was renewed, {date:%Y-%m-%d}"
    columns = (Column("usage"), Column(since, is_number=True), Column("total", is_number=True))
    old, new = _usage_cells(used, valve), _usage_cells(everything, valve)
    table = PageTable(columns, tuple((name, old[name], new[name]) for name in old))
    life = () if limits is None else _life(limits)
    words, pace = _MEANING, usage.pace()
    if pace is not None:
        words += (
            f" Recent pace: {pace.distance:.3g} m and {pace.reversals:.3g} reversals per day "
            "monitored."
        )
    if not used.time_watched:
        return Section("Use", (table, *life, Paragraph(words)))
    picture = Picture(
        usage_figure(usage),
        "Time at each 5 % of the travel, and the travelled distance of each day.",
        "A histogram of the stem position, and the distance of each day.",
        usage_figure(usage, is_narrow=True),
    )
    return Section("Use", (table, *life, picture, Paragraph(words)))


def _life(limits: Sequence[LimitState]) -> tuple[PageTable | Paragraph, ...]:
    """Return the used share of each packing limit, and the advice."""
    if not limits:
        return (Paragraph(_NO_LIMIT),)
    titles = ("packing limit", "used", "limit", "share", "expected")
    columns = tuple(Column(title, is_number=title != titles[0]) for title in titles)
    rows = tuple(
        (
            f"{one.name} [{_UNITS[one.name]}]",
            f"{one.used:.5g}",
            f"{one.limit:.6g}",
            percentage(one.used / one.limit),
            _expected(one),
        )
        for one in limits
    )
    warnings = (f"{capitalised(one.message)}." for one in limits if one.warns)
    return PageTable(columns, rows), *map(Paragraph, warnings)


def _expected(state: LimitState) -> str:
    if state.is_reached:
        return "reached"
    if state.expected is None:
        return "not known before a day of monitoring"
    return utc_day(state.expected)


def _usage_cells(usage: Usage, valve: Valve) -> dict[str, str]:
    return {
        "travelled distance [m]": f"{usage.distance:.5g}",
        "full-travel strokes": f"{usage.strokes(valve.travel):.5g}",
        "reversals": f"{usage.reversals}",
        "breakaways": f"{usage.breakaways}",
        "time monitored [h]": f"{usage.time_watched / 3600e9:.4g}",
        "time near 0 % of the travel [h]": f"{usage.time_near_seat() / 3600e9:.4g}",
        "time near 100 % of the travel [h]": f"{usage.time_near_seat(True) / 3600e9:.4g}",
    }


_FIGURES = (
    ("dead time [s]", "dead_time", 1.0),
    ("T63 [s]", "t63", 1.0),
    ("T86 [s]", "t86", 1.0),
    ("overshoot [% of the move]", "overshoot", 100.0),
    ("steady error [% of the travel]", "steady_error", 100.0),
)
_CAUSES = (("dead time", "dead_time"), ("T86", "t86"), ("steady error", "deviation"))


def response_section(response: ResponseSummary) -> Section | None:
    """Return the figures of the latest command steps as tables, or None without a step."""
    if not response.moves:
        return None
    columns = ("median", "10 %", "90 %", "steps")
    table = PageTable(
        (Column("answer"), *(Column(name, is_number=True) for name in columns)),
        tuple(
            (words, *_spread_cells(getattr(response, name), scale))
            for words, name, scale in _FIGURES
        ),
    )
    sizes = PageTable(
        (Column("step [% of the travel]"), Column("moved the stem", is_number=True)),
        tuple(
            (_bounds(*bounds), f"{moved} of {count}")
            for bounds, (moved, count) in zip(pairwise(SIZES), response.by_size, strict=True)
            if count
        ),
    )
    causes = " ".join(
        f"{capitalised(name)}: {member_words(response.cause(which).name, 'cause')}."
        for name, which in _CAUSES
    )
    words = (
        "The figures, after ANSI/ISA-75.25, are those of the latest "
        f"{len(response.moves)} steps of stem_command, {_dates(response.moves)}; "
        f"{len(response.ignored)} of them did not move the stem. "
        "Steady error is command less position."
    )
    return Section("Response to the command", (table, sizes, Paragraph(words), Paragraph(causes)))


def _spread_cells(spread: Spread, scale: float) -> tuple[str, ...]:
    if not spread.number:
        return ("–", "–", "–", "0")
    values = (f"{scale * one:.3g}" for one in (spread.median, spread.low, spread.high))
    return (*values, str(spread.number))


def _bounds(low: float, high: float) -> str:
    return f"{100 * low:g} to {100 * high:g}" if high < 1 else f"above {100 * low:g}"


def _dates(moves: tuple[StepAnswer, ...]) -> str:
    stamps = [one.stamp for one in moves]
    first, last = (f"{utc(stamp):%Y-%m-%d %H:%M}" for stamp in (min(stamps), max(stamps)))
    return f"from {first} to {last} UTC"
