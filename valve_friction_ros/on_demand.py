# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Public names of a package that are loaded on their first use.

A package that re-exports what its modules hold would otherwise load all of them with the first:
``valve_friction identify --help`` needs the names of the settings, and not a compiler.
"""

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def _homes(source: Path) -> dict[str, str]:
    """Return the module of each name that a package imports for the type checker alone."""
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

    Its names are those that its ``__init__.py`` imports in ``if TYPE_CHECKING:``, so there is one
    list of them, which the type checker reads too: ``import a as a`` says that a is public. They
    are its ``__all__`` where it has none. None may be called like a module of the package:
    whoever imported that module first would get it in place of the name.

    Parameters
    ----------
    package : str
        Its ``__name__``.

    Returns
    -------
    callable
        Takes a name and loads it; raises AttributeError for one that is not in the list.
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
