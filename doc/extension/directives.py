# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Directives that write pages of the reference from the code."""

from collections.abc import Callable
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from extension.command_options import command_as_markdown, list_as_markdown
from extension.diagnostic_keys import keys_as_markdown
from extension.history_schema import schema_as_markdown
from extension.node_graph import graph_as_markdown
from extension.node_parameters import parameters_as_markdown
from extension.project_file import file_as_markdown, rst_as_markdown

__all__ = ["setup"]

_log = logging.getLogger(__name__)


def _directive(write: Callable[..., str], arguments: int, more: int = 0) -> type[SphinxDirective]:
    """Return a directive that shows what a function writes of its arguments."""

    class Written(SphinxDirective):
        required_arguments = arguments
        optional_arguments = more
        final_argument_whitespace = not more  # a command of two words

        def run(self) -> list[nodes.Node]:
            try:
                text = write(*self.arguments)
            except ImportError as error:  # where rosdoc2 runs without the libraries of the package
                text = f"*Not written here: {error}.*"
                _log.warning("%s: %s", self.name, error)
            return self.parse_text_to_nodes(text, allow_section_headings=True)

    return Written


def _keep_bars(*event: Any) -> None:
    """Let |x| in a docstring be a magnitude, which reStructuredText takes as a substitution."""
    lines = event[-1]
    for place, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = line.split("``")
            parts[::2] = [part.replace("|", "\\|") for part in parts[::2]]
            lines[place] = "``".join(parts)


def _skip_aliases(*event: Any) -> bool | None:
    """Leave out the fields of a named tuple, which its docstring describes."""
    found = event[3]
    return True if type(found).__name__ == "_tuplegetter" else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directives."""
    app.add_directive("node-parameters", _directive(parameters_as_markdown, 1, 3))
    for name, write, arguments in (
        ("node-graph", graph_as_markdown, 2),
        ("diagnostic-keys", keys_as_markdown, 1),
        ("command-options", command_as_markdown, 1),
        ("command-list", list_as_markdown, 0),
        ("history-schema", schema_as_markdown, 0),
        ("project-file", file_as_markdown, 1),
        ("project-rst", rst_as_markdown, 1),
    ):
        app.add_directive(name, _directive(write, arguments))
    app.connect("autodoc-process-docstring", _keep_bars)
    app.connect("autodoc-skip-member", _skip_aliases)
    return {"parallel_read_safe": True}
