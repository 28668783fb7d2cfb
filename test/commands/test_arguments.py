# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Options that are declared as their help shows them."""

import argparse
from pathlib import Path

import pytest

from valve_friction_ros.commands.arguments import add_options, percent

TEXT = """
    --plot FILE.png: draw it, --on a grid
        of 5 %%
    --folder DIR: where
    --json: print it
    --name NAME: of it (%(default)s)
    --jobs N: how many
    """


@pytest.fixture
def parser():
    parser = argparse.ArgumentParser()
    add_options(parser, TEXT, name={"default": "all"}, jobs={"type": int, "required": True})
    return parser


def test_paths_texts_flags_and_what_is_said_beside(parser):
    given = ["--plot", "a.png", "--folder", "b", "--json", "--jobs", "2"]
    wanted = argparse.Namespace(plot=Path("a.png"), folder=Path("b"), json=True, name="all", jobs=2)
    assert parser.parse_args(given) == wanted
    left_out = argparse.Namespace(plot=None, folder=None, json=False, name="all", jobs=2)
    assert parser.parse_args(["--jobs", "2"]) == left_out


def test_the_help_is_the_text(parser):
    shown = " ".join(parser.format_help().split())
    for words in ("--plot FILE.png draw it, --on a grid of 5 %", "--name NAME of it (all)"):
        assert words in shown


@pytest.mark.parametrize(("text", "share"), [("90", 0.9), ("2.5 %", 0.025), ("-10", -0.1)])
def test_percent(text, share):
    assert percent(text) == pytest.approx(share)


@pytest.mark.parametrize("text", ["101", "many", "nan", ""])
def test_no_percent(text):
    with pytest.raises(argparse.ArgumentTypeError, match="is not a percentage, such as 90"):
        percent(text)
