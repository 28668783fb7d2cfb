# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files of the project that a page shows."""

from pathlib import Path

__all__ = ["file_as_markdown", "rst_as_markdown"]

_LANGUAGES = {".yaml": "yaml", ".py": "python", ".csv": "text"}


def _found(path: str) -> Path:
    """Return a file of the project, named from its root."""
    import valve_friction_ros

    return Path(valve_friction_ros.__file__).parents[1] / path


def file_as_markdown(path: str) -> str:
    """Return a file of the project, named from its root, as a block of code."""
    found = _found(path)
    text = found.read_text(encoding="utf-8").rstrip()
    return f"```{_LANGUAGES[found.suffix]}\n{text}\n```"


def rst_as_markdown(path: str) -> str:
    """Return a file of reStructuredText, named from the root, without its title."""
    text = _found(path).read_text(encoding="utf-8")
    _, _, body = text.partition("\n\n")
    return f"````{{eval-rst}}\n{body}\n````"
