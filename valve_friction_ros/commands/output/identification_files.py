"""What `identify` writes of a valve beside its result: a picture and a report."""

import argparse
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.commands.arguments.recording import require_one
from valve_friction_ros.health import Baseline
from valve_friction_ros.identification import RefusalError, Result
from valve_friction_ros.model import Recording
from valve_friction_ros.records.recorded_valve import RecordedValve

__all__ = ["IdentificationFiles", "baseline_from", "identification_files"]


def baseline_from(options: argparse.Namespace) -> Baseline | None:
    """Build the baseline from the parsed arguments.

    Raises ValueError if it is impossible, or its interval is given without it.
    """
    friction, width = options.baseline_coulomb_friction, options.baseline_half_width
    if options.baseline_recording is not None and (friction, width) != (None, None):
        raise ValueError("--baseline-recording: its friction is the baseline: give no other one")
    if friction is None:
        if width is not None:
            raise ValueError(
                "--baseline-half-width: give the baseline itself by --baseline-coulomb-friction"
            )
        return None
    return Baseline(friction, 0.0 if width is None else width)


class IdentificationFiles(NamedTuple):
    """The files to write."""

    plot: Path | None
    report: Path | None
    healthy: Recording | None = None

    def compared_with(
        self, recorded: RecordedValve, outcome: Result | RefusalError
    ) -> tuple[Baseline, "IdentificationFiles"]:
        """Return the frictions of the healthy valve, and the files with its record in them.

        Raises RefusalError, which names its file, where it cannot be a baseline.
        """
        if isinstance(outcome, RefusalError):
            raise outcome
        try:
            return Baseline.of(outcome), self._replace(healthy=outcome.recording)
        except RefusalError as refusal:
            raise recorded.refused(refusal) from None

    def require_one_valve(self, recorded: Sequence[RecordedValve]) -> None:
        """Refuse several valves; raises ValueError, which names them."""
        if self.plot is not None:
            require_one(recorded, "--plot draws")
        if self.report is not None:
            require_one(recorded, "--report is of")

    def write(
        self,
        recorded: RecordedValve,
        result: Result,
        baseline: Baseline | None,
    ) -> None:
        """Write them; raises OSError, which names the file, where that fails."""
        if self.plot is None and self.report is None:
            return

        from valve_friction_ros import figures  # noqa: PLC0415 - slow to import

        if self.plot is not None:
            figures.save_picture(figures.identification_figure(result), self.plot)
        if self.report is not None:
            from valve_friction_ros import reports  # noqa: PLC0415 - slow to import

            record = reports.IdentifiedRecord(
                name=recorded.name.strip("/") or recorded.path.name,
                source=recorded.label,
                result=result,
                baseline=baseline,
                notes=recorded.notes,
                dated=_dated(recorded.path),
                healthy=self.healthy,
            )
            reports.write_report(reports.identification_report(record), self.report)


def _dated(path: Path) -> str:
    """Return when a file was last changed, in words; empty where it has no such time."""
    if not path.is_file():
        return ""
    changed = datetime.fromtimestamp(path.stat().st_mtime, timezone.utc)
    return f"its file was last changed {changed:%Y-%m-%d %H:%M} UTC"


def identification_files(options: argparse.Namespace) -> IdentificationFiles:
    """Return the files that were asked for.

    Raises ValueError, which names the file and the cause, for a file that cannot be written.
    """
    if options.plot is not None:
        from valve_friction_ros.figures import require_picture_file  # noqa: PLC0415 - slow to import

        require_picture_file(options.plot)
    if options.report is not None:
        from valve_friction_ros.reports import require_report_file  # noqa: PLC0415 - slow to import

        require_report_file(options.report)
    return IdentificationFiles(options.plot, options.report)
