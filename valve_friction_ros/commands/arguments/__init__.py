# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arguments shared by sub-commands, and the objects built from them."""

import argparse
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from valve_friction_ros import figures

_OPTION = re.compile(r"^ *(--[a-z-]+)(?: (\S+)|): ", re.MULTILINE)


def add_options(parser: argparse._ActionsContainer, text: str, **more: Mapping[str, Any]) -> None:
    """Declare options in the form of their help text.

    Parameters
    ----------
    parser : ArgumentParser, or a group of one
        The parser that takes the options.
    text : str
        Each option starts a new line, as ``--plot FILE.png: draw it``. An option without a
        placeholder is a flag. It takes a path if the placeholder is FILE, DIR or FOLDER or has a
        file name extension. Otherwise it takes text, unless `more` gives another type.
    **more
        Further keywords of `add_argument` by option, such as ``jobs={"type": int}``.
    """
    _, *parts = _OPTION.split(text)
    for name, takes, words in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        told: dict[str, Any] = {"action": "store_true"}
        if takes:
            is_place = "." in takes or takes in ("FILE", "DIR", "FOLDER")
            told = {"type": Path if is_place else str, "metavar": takes}
        told |= more.get(name[2:].replace("-", "_"), {})
        parser.add_argument(name, help=" ".join(words.split()), **told)


def percent(text: str, least: float = -math.inf, words: str = ", such as 90") -> float:
    """Parse a percentage between `least` times 100 and 100; return the share."""
    try:
        share = float(text.rstrip(" %")) / 100
    except ValueError:
        share = math.nan
    if not least <= share <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a percentage{words}")
    return share


def require_outputs(*files: Path | None, picture: Path | None = None) -> None:
    """Refuse files that cannot be written, before the work starts; None means no file."""
    for path in files:
        if path is not None and not path.parent.is_dir():
            raise ValueError(f"{path}: there is no folder {path.parent}")
    if picture is not None:
        figures.require_picture_file(picture)
