# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The pages hold what the code declares, draw each room, and have nothing that axe-core faults."""

import ast
import contextlib
import re
import shutil
from pathlib import Path

import pytest
from browser import axe_violations, chromium
from extension.command_options import command_as_markdown, command_names, parser_of
from extension.diagnostic_keys import declared_keys, entries, is_explained
from extension.history_schema import schema, schema_as_markdown
from extension.meanings import meanings, require_all
from extension.node_parameters import parameter_entries, parameters_as_markdown
from kept_rows import run_here

from valve_friction_ros.settings import NODES

PROJECT = Path(__file__).resolve().parents[1]
REFERENCE = PROJECT / "doc" / "reference"


def shown(name):
    return (REFERENCE / f"{name}.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("node", NODES)
def test_a_page_shows_the_parameters_of_each_node(node):
    assert re.search(rf"^```{{node-parameters}} {node}\b", shown("nodes"), re.MULTILINE)
    for entry in parameter_entries(node):
        assert entry.meaning.count(" ") >= 2, entry.term
        assert entry.facts.startswith(("`", "empty", "not stated")), entry.term


def test_each_parameter_has_its_description_unit_and_default():
    text = parameters_as_markdown("identifier")
    for spec in NODES["identifier"]:
        assert re.search(r" \[[^\]]+\]", spec.description), f"{spec.name} has no unit"
        assert f"`{spec.name}`\n: " in text
    assert (
        "`window`\n: `60.0` s; 0.1 to 86400\n\n"
        "  Length of the record that is buffered and identified.\n"
    ) in text
    assert "`joint`\n: `stem`; at start only\n" in text
    assert "`travel`\n: not stated: `0.028575` m is assumed\n" in text
    assert "`mass`\n: not stated; 1e-06 to 1e+06\n" in text
    assert "`valve_tag`\n: empty; at start only\n" in text


def test_a_page_shows_each_sub_command_with_all_its_options():
    page = shown("commands")
    for command in command_names():
        assert f"## {command}\n\n```{{command-options}} {command}\n" in page
        text = command_as_markdown(command)
        for action in parser_of(command)._actions:
            for option in set(action.option_strings) - {"-h", "--help"}:
                assert re.search(rf"`[^`]*{option}\b[^`]*`\n: \S", text), (command, option)


def test_each_key_of_diagnostics_has_a_meaning():
    assert len(declared_keys()) > 100
    page = shown("diagnostics")
    for section, keys in entries().items():
        assert f"```{{diagnostic-keys}} {section}\n" in page
        assert all(entry.meaning for entry in keys)
    assert is_explained("evidence spring_constant [N/m]")
    assert is_explained("slip_force change low [N]")
    assert not is_explained("spring_constancy [N/m]")


def test_no_writer_of_keys_is_forgotten():
    """Whatever offers `values` of a node's diagnostics is among those that are read."""
    from extension.diagnostic_keys import _WRITERS

    nodes = PROJECT / "valve_friction_ros" / "nodes"
    for path in nodes.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name == "values" and node.args.args:
                name = path.relative_to(nodes).as_posix()
                assert "values" in _WRITERS[name]


def test_each_column_of_the_history_has_a_meaning():
    text = schema_as_markdown()
    for table, columns in schema().items():
        section = text.partition(f"## `{table}`\n")[2].partition("\n## ")[0]
        for column in columns:
            assert re.search(rf"^\| `{column.name}` \| [^|]+ \| [^|]+ \|$", section, re.MULTILINE)


def test_a_name_without_a_meaning_is_refused():
    with pytest.raises(ValueError, match=r"keys without a meaning .*\['new'\]"):
        require_all("keys", ["old", "new"], ["old"])
    with pytest.raises(ValueError, match=r"no code has: \['gone'\]"):
        require_all("keys", ["old"], ["old", "gone"])
    assert meanings()["graph"].keys() == {
        "dashboard",
        "identifier",
        "simulator",
        "pressure_source",
        "stroke_player",
    }


@pytest.fixture(scope="module")
def browser():
    with chromium() as one:
        yield one


@pytest.mark.parametrize("name", ["index", "how_to/dashboards", "reference/diagnostics"])
def test_axe_finds_nothing_wrong_with_a_built_page(browser, name):
    """A page of each kind, as the last `make docs` has built it with the style of now."""
    built = PROJECT / "build" / "docs"
    styles = [Path("_static") / file for file in ("site.css", "site.js")]
    if not all(
        (built / one).is_file()
        and (built / one).read_bytes() == (PROJECT / "doc" / one).read_bytes()
        for one in styles
    ):
        pytest.skip("the documentation is not built with the style of now: run `make docs`")
    with contextlib.closing(browser.new_page()) as page:
        page.goto((built / f"{name}.html").as_uri())
        for width in (390, 1400):
            page.set_viewport_size({"width": width, "height": 900})
            assert axe_violations(page) == [], width


SOURCES = PROJECT / "valve_friction_ros"
PAGE = (PROJECT / "doc" / "rooms.md").read_text(encoding="utf-8")
DRAWING, REST = PAGE.split("## Each room in one line")
TABLE, PLACES = REST.split("## Where is …")


def rooms(depth):
    found = SOURCES.glob("/".join(["*"] * depth) + "/__init__.py")
    return {path.parent.relative_to(SOURCES).as_posix() for path in found}


def rooms_of_one_file():
    """Names that the page gives as a single file, and that are one."""
    named = [cell.strip("`") for cell in first_cells(TABLE)]
    return {name for name in named if (SOURCES / name).is_file()}


def first_cells(text):
    return [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| `")]


def test_every_room_has_one_line():
    named = [cell.strip("`/") for cell in first_cells(TABLE)]
    assert sorted(named) == sorted(rooms(1) | rooms(2) | rooms_of_one_file())


@pytest.mark.parametrize("room", sorted(rooms(1)))
def test_every_room_is_drawn(room):
    assert re.search(rf"\b{room}\b", DRAWING)


@pytest.mark.parametrize("inner", ["trust", "published", "engine", "signature", "steps"])
def test_the_rooms_of_identification_are_drawn(inner):
    assert re.search(rf"\b{inner}\b", DRAWING)


def test_every_named_file_is_there():
    named = re.findall(r"`([a-z_/]+\.py)`", PLACES)
    assert len(named) > 20
    missing = [
        name for name in named if not any((home / name).is_file() for home in (SOURCES, PROJECT))
    ]
    assert not missing


@pytest.mark.parametrize("equation", range(1, 21))
def test_every_equation_has_a_place(equation):
    """(14) stands in a line as itself, or within a range such as (11) to (13)."""
    cells = [line.split("|")[1] for line in PLACES.splitlines() if line.startswith("| (")]
    covered = set()
    for cell in cells:
        for first, last in re.findall(r"\((\d+)\) to \((\d+)\)", cell):
            covered |= set(range(int(first), int(last) + 1))
        covered |= {int(number) for number in re.findall(r"\((\d+)\)", cell)}
    assert equation in covered


EXAMPLES = PROJECT / "examples"


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """A folder with two recordings, one of which is refused, and what is written of it."""
    folder = tmp_path_factory.mktemp("plant")
    shutil.copy(EXAMPLES / "five_seconds.csv", folder / "FV-101.csv")
    (folder / "FV-102.csv").write_text("time_s,pressure_pa,position_m\n0,1,1\n1,1,1\n")
    valve = ["--valve", EXAMPLES / "fv_101.yaml"]
    run_here(["identify-folder", folder, *valve, "--output", folder / "plant.html"])
    return folder


def test_pages_of_a_folder_and_of_its_valves(browser, reports):
    found = sorted(reports.rglob("*.html"))
    assert len(found) >= 2
    with contextlib.closing(browser.new_page(bypass_csp=True)) as page:
        for path in found:
            page.goto(path.as_uri())
            for width, theme in ((1400, "light"), (390, "light"), (1400, "dark")):
                page.set_viewport_size({"width": width, "height": 900})
                page.emulate_media(color_scheme=theme)
                assert axe_violations(page) == [], (path.name, width, theme)
