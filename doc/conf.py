# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Settings of Sphinx, for `make docs` and for rosdoc2, which runs them in a copy of this folder."""

import contextlib
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from extension.directives import setup  # noqa: E402, F401 - Sphinx calls it

project = "valve_friction_ros"
author = "valve_friction_ros developers"
copyright = "valve_friction_ros developers, Apache-2.0"
with contextlib.suppress(ImportError):  # rosdoc2 knows the version, and may know the path later
    from valve_friction_ros import __version__

    version = release = __version__

extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_parser"]
myst_enable_extensions = ["attrs_inline", "deflist", "fieldlist"]
myst_heading_anchors = 4
exclude_patterns = ["_build", "extension"]
smartquotes = False  # -- begins an option

default_role = "code"  # `name` in a docstring
suppress_warnings = ["ref.python"]  # a word in a docstring that names several things
autodoc_member_order = "groupwise"
autodoc_typehints = "none"  # the docstrings have them
napoleon_google_docstring = False

html_theme = "sphinx_rtd_theme"
html_theme_options = {"navigation_depth": 2}
toc_object_entries = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_show_sourcelink = False

rosdoc2_settings = {"override_theme": False}
