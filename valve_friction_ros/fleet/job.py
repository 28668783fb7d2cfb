"""One recording to identify, and the rows of its results."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from valve_friction_ros import __version__
from valve_friction_ros.fleet.row import Cell, error_cells, result_cells
from valve_friction_ros.identification import IdentificationSettings, RefusalError, method_named
from valve_friction_ros.model import Valve
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings

__all__ = ["Job", "Options", "identify_job"]


@dataclass(frozen=True)
class Options:
    """Valve, options of reading, method and settings with which a recording is identified."""

    valve: Valve
    reading: ReadingOptions
    method: str
    settings: IdentificationSettings

    def fingerprint(self) -> str:
        """Return a digest of all options and of the version of the package."""
        settings = [
            (field.name, getattr(self.settings, field.name))
            for field in fields(self.settings)
            if field.name != "fixed"
        ]
        everything = (
            __version__,
            self.valve,
            self.reading,
            self.method,
            settings,
            sorted(self.settings.fixed.items()),
        )
        return hashlib.blake2b(repr(everything).encode(), digest_size=8).hexdigest()


@dataclass(frozen=True)
class Job:
    """A recording and how to identify it, to be handed to another process."""

    path: Path
    options: Options


def _cells(job: Job, recorded: RecordedValve) -> Mapping[str, Cell]:
    options = job.options
    try:
        recording = recorded.recording()
        identify = method_named(options.method)
        result = identify(recording, options.valve, options.settings)
    except RefusalError as refusal:
        return error_cells(recorded.name, str(refusal), job.path)
    return result_cells(recorded.name, result, recording, recorded.notes)


def identify_job(job: Job) -> list[Mapping[str, Cell]]:
    """Read and identify a recording.

    Returns the cells of a row for each valve, at least one, in the order of the file; a refusal has
    its reason under ``error``.
    """
    try:
        recorded = read_recordings(job.path, job.options.valve, job.options.reading)
        return [_cells(job, each) for each in recorded]
    except (ValueError, RefusalError, OSError) as error:
        return [error_cells("", str(error), job.path)]
    except Exception as error:  # noqa: BLE001 - one bad recording must not end the others
        return [error_cells("", f"unexpected {type(error).__name__}: {error}", job.path)]
