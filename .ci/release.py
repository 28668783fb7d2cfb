# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a release still lacks: `python3 .ci/release.py`; the exit code is 1 if it lacks anything.

`--headers` writes the copyright notice into the files that lack it.
"""

import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
PLACEHOLDER = re.compile(r"[.@](example|invalid|test|localhost)(\.(com|org|net))?$")
"""Ends of addresses that nobody can have (RFC 2606)."""
FOLDERS = ("valve_friction_ros", "launch", "config", "examples", "benchmark", "test", "doc", ".ci")
NOTICE = """\
# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.
"""


def sources(project: Path) -> list[Path]:
    """Return the Python files that carry the notice."""
    found = [path for folder in FOLDERS for path in (project / folder).rglob("*.py")]
    return sorted([*found, project / "setup.py"])


def without_notice(project: Path) -> list[Path]:
    """Return those that lack it; an empty file needs none."""
    lacks = re.compile(r"\A(#!.*\n)?# Copyright ").search
    return [
        path for path in sources(project) if (text := path.read_text("utf-8")) and not lacks(text)
    ]


def write_notices(project: Path) -> None:
    """Write the notice into the files that lack it, below a line that says how they are run."""
    for path in without_notice(project):
        first, text = "", path.read_text("utf-8")
        if text.startswith("#!"):
            first, _, text = text.partition("\n")
            first += "\n"
        path.write_text(f"{first}{NOTICE}\n{text}", "utf-8")


def faults(project: Path) -> list[str]:
    """Return what is left for the owner, and what the files contradict."""
    manifest = ET.parse(project / "package.xml").getroot()  # noqa: S314 - our own
    found = []
    for role in ("maintainer", "author"):
        people = manifest.findall(role)
        if not people:
            found.append(f"package.xml: there is no <{role}>")
        found += [
            f"package.xml: <{role}> has the placeholder {address}"
            for one in people
            if PLACEHOLDER.search(address := one.get("email", "@invalid"))
        ]
    kinds = {url.get("type") for url in manifest.findall("url")}
    found += [
        f'package.xml: there is no <url type="{kind}">'
        for kind in ("website", "repository", "bugtracker")
        if kind not in kinds
    ]
    version = manifest.findtext("version")
    own = (project / "valve_friction_ros/__init__.py").read_text("utf-8")
    if f'__version__ = "{version}"' not in own:
        found.append(
            f"valve_friction_ros/__init__.py: __version__ is not {version}, as in package.xml"
        )
    changes = (project / "CHANGELOG.rst").read_text("utf-8")
    if not re.search(rf"^{re.escape(str(version))} \(\d{{4}}-\d\d-\d\d\)$", changes, re.MULTILINE):
        found.append(f"CHANGELOG.rst: {version} has no date: run catkin_prepare_release")
    bare = [path.relative_to(project).as_posix() for path in without_notice(project)]
    if bare:
        found.append(
            f"{len(bare)} files without a copyright notice, such as {bare[0]}: "
            "run `python3 .ci/release.py --headers`"
        )
    return found


if __name__ == "__main__":
    if "--headers" in sys.argv:
        write_notices(PROJECT)
    said = faults(PROJECT)
    print("\n".join(said) or "nothing is left to do")  # noqa: T201
    sys.exit(bool(said))
