"""Reports and bags of a valve, offered from the folders that the dashboard knows and no others."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.dashboard.options import DashboardOptions
from valve_friction_ros.outside_text import printable

__all__ = ["OfferedFile", "ValveFiles"]

_ENDINGS = (".html", ".mcap", ".db3", ".yaml")
_MOST = 40
_MOST_LOOKED = 20_000


class OfferedFile(NamedTuple):
    """A file: its folder's name and path below it, a label, its size (bytes) and time (s)."""

    kind: str
    path: str
    label: str
    size: int
    time: float


def _stem(namespace: str) -> str:
    return namespace.strip("/").replace("/", "_")


@dataclass(frozen=True)
class ValveFiles:
    """The folders of reports, bags and alarms.

    Attributes
    ----------
    folders : mapping of str to Path
        The folders by the names that addresses use.
    """

    folders: Mapping[str, Path]

    @classmethod
    def of(cls, options: DashboardOptions) -> "ValveFiles":
        """Return the folders of a dashboard."""
        named = {"reports": options.reports, "bags": options.bags, "alarms": options.alarms}
        return cls({name: path for name, path in named.items() if path is not None})

    def found(self, kind: str, path: str) -> Path | None:
        """Return a file by its folder's name and its path there.

        None for what is not there, is no report and no part of a bag, or lies outside the folder,
        also by a link.
        """
        folder = self.folders.get(kind)
        if folder is None or "\0" in path:
            return None
        try:
            root = folder.resolve(strict=True)
            wanted = (root / path).resolve(strict=True)
        except (OSError, RuntimeError):
            return None
        is_inside = wanted.is_relative_to(root) and wanted.suffix.lower() in _ENDINGS
        return wanted if is_inside and wanted.is_file() else None

    def offered(self, namespace: str) -> list[OfferedFile]:
        """Return reports and bags of the valve of a namespace, the newest first."""
        stem = _stem(namespace)
        found: list[OfferedFile] = []
        for kind, folder in self.folders.items():
            start = f"alarm_{stem}_" if kind == "alarms" else f"{stem}_"
            name = re.compile(rf"{re.escape(start)}\d{{8}}T\d{{6}}Z")
            try:
                places = sorted(folder.iterdir(), key=lambda one: one.name, reverse=True)
            except OSError:
                continue
            mine = [p for p in places[:_MOST_LOOKED] if name.match(p.name)]
            for place in mine[:_MOST]:
                found += self._files(kind, folder, place)
        return sorted(found, key=lambda one: -one.time)[: 2 * _MOST]

    @staticmethod
    def sharing(namespace: str, others: Iterable[str]) -> tuple[str, ...]:
        """Return the other namespaces whose files have the same names, as /a/b and /a_b have."""
        stem = _stem(namespace)
        found = {one for one in others if one != namespace and _stem(one) == stem}
        return tuple(sorted(found))

    def _files(self, kind: str, folder: Path, place: Path) -> list[OfferedFile]:
        try:
            inside = [place] if place.is_file() else sorted(place.iterdir())[:20]
            return [
                OfferedFile(
                    kind,
                    one.relative_to(folder).as_posix(),
                    printable(one.relative_to(folder).as_posix(), 200),
                    (about := one.stat()).st_size,
                    about.st_mtime,
                )
                for one in inside
                if one.suffix.lower() in _ENDINGS and one.is_file()
            ]
        except OSError:
            return []
