# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Lazy loading of the public names of a package.

A package that re-exports names from its modules would otherwise load all modules with the first
name. ``valve_friction identify --help`` needs the names of the settings, but no compiler.
"""

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def _homes(source: Path) -> dict[str, str]:
    """Return the module of each name that a package imports only for the type checker."""
    tree = ast.parse(source.read_bytes())
    return {
        alias.name: str(statement.module)
        for block in tree.body
        if isinstance(block, ast.If)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }


def names_on_demand(package: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` (PEP 562) of a package.

    The public names are those that ``__init__.py`` imports in ``if TYPE_CHECKING:``. The type
    checker reads the same list: ``import a as a`` marks a as public. The list also serves as
    ``__all__`` where the package defines none. No name may equal that of a module of the package:
    if the module were imported first, it would hide the name.

    Parameters
    ----------
    package : str
        ``__name__`` of the package.

    Returns
    -------
    callable
        Loads a name; raises AttributeError for a name that is not in the list.
    """
    homes: dict[str, str] = {}

    def load(name: str) -> Any:
        module = sys.modules[package]
        if not homes:
            homes.update(_homes(Path(str(module.__file__))))
        if name == "__all__":
            return sorted(homes)
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        found = getattr(import_module(homes[name]), name)
        setattr(module, name, found)
        return found

    return load
