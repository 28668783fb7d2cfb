# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""README, pages and notebook: their code runs as it is pasted, and their links lead somewhere."""

import ast
import contextlib
import json
import re
import shlex
import struct
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import yaml
from documentation import PAGES, PROJECT, README, snippets

from valve_friction_ros.commands.main import run
from valve_friction_ros.records.valve_file import read_yaml


def test_the_readme_is_short():
    assert PAGES[README].count("\n") <= 120


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def assert_same_sentences(printed, shown):
    """Each word is there as it is shown; numbers to 2 %, as a processor may round otherwise."""
    expected_lines = shown.splitlines()
    lines = printed.splitlines()[: len(expected_lines)]
    for line, written in zip(lines, expected_lines, strict=True):
        assert NUMBER.sub("#", line).split() == NUMBER.sub("#", written).split()
        numbers, expected = (
            [float(one) for one in NUMBER.findall(each)] for each in (line, written)
        )
        assert numbers == pytest.approx(expected, rel=0.02, abs=0.02)


def test_the_page_of_the_notebook_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    found = snippets("python", PAGES[PROJECT / "doc" / "start" / "notebook.md"])
    assert len(found) == 2
    names: dict[str, object] = {}
    for snippet in found:
        exec(compile(snippet, "notebook.md", "exec"), names)
    printed = capsys.readouterr().out
    (shown,) = snippets("text", PAGES[PROJECT / "doc" / "start" / "notebook.md"])
    assert_same_sentences(printed, shown)
    low, high = names["result"].parameters["coulomb_friction"].interval
    assert low < 606.0 < high
    assert (tmp_path / "valve.png").stat().st_size > 10_000
    bracket = names["test"].dead_band
    assert (bracket.ignored, bracket.answered) == pytest.approx((4, 5), rel=1e-9)


NEED_NODES = (
    "history",
    "call",
    "dashboard",
    "identify fv_101_2026",
    "reproduce-paper",
)  # or minutes: the last


def offline_commands():
    """Commands that need neither nodes nor minutes, each once."""
    blocks = "".join(snippets("sh")).replace("\\\n", " ")
    commands = re.findall(r"^\.venv/bin/valve_friction (.*)$", blocks, re.MULTILINE)
    each_once = dict.fromkeys(re.sub(r" {2,}", " ", one) for one in commands)
    return [each for each in each_once if not each.startswith(NEED_NODES)]


def test_the_examples_of_the_readme_print_its_table(monkeypatch, capsys):
    monkeypatch.chdir(PROJECT)
    (command,) = (one for one in offline_commands() if "one_minute.png" in one)
    assert run(shlex.split(command.partition(" --plot")[0])) == 0
    found = capsys.readouterr().out.splitlines()
    shown = snippets("text", PAGES[README])[0].splitlines()
    assert len(shown) == 8
    for line, written in zip(found, shown, strict=False):
        assert [word for word in line.split() if not word[0].isdigit()] == [
            word for word in written.split() if not word[0].isdigit()
        ]
    assert float(found[3].split()[1]) == pytest.approx(float(shown[3].split()[1]), rel=1e-3)
    (snippet,) = snippets("python", PAGES[README])
    exec(compile(snippet, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed.startswith("parameter ")
    assert "friction is 2.0" in printed


def test_options_describe_a_table_as_its_valve_file_does(tmp_path, monkeypatch, capsys):
    """The numbers are equal, and the options lack nothing that the section `columns:` says."""
    monkeypatch.chdir(PROJECT)
    line = (
        "identify examples/five_seconds.csv --valve examples/fv_101.yaml --delimiter ';' "
        "--time-column Time --time-zone Europe/Berlin --position-column 'Stem position' "
        "--position-unit percent --pressure-column 'Actuator pressure' --pressure-unit bar"
    )
    described = PROJECT / "examples" / "fv_101.yaml"
    valve = read_yaml(described)["/**"]["ros__parameters"]
    del valve["columns"]
    bare = tmp_path / "bare.yaml"
    bare.write_text(yaml.safe_dump(valve))
    options = shlex.split(line)
    place = options.index("--valve") + 1
    answers = []
    for words in (
        options,
        [*options[:place], str(bare), *options[place + 1 :]],
        ["identify", "examples/five_seconds.csv", "--valve", str(described)],
    ):
        assert run([*words, "--method", "bench", "--json"]) == 0
        answers.append(capsys.readouterr().out)
    assert answers[0] == answers[1] == answers[2]


@pytest.mark.timeout(400)
def test_the_offline_commands_run_as_they_are_pasted(tmp_path, monkeypatch, capsys):
    for folder in ("examples", "config"):
        (tmp_path / folder).symlink_to(PROJECT / folder)
    monkeypatch.chdir(tmp_path)
    offline = offline_commands()
    assert len(offline) == 8
    for each in offline:
        line, _, output = each.partition(" > ")
        with contextlib.ExitStack() as stack:
            if output:
                stream = stack.enter_context((tmp_path / output).open("w"))
                stack.enter_context(contextlib.redirect_stdout(stream))
            assert run(shlex.split(line, comments=True)) == 0, each
    assert re.search(r"^coulomb_friction +40[01]", capsys.readouterr().out, re.MULTILINE)
    written = {path.name for path in tmp_path.iterdir()}
    assert {
        "one_minute.png",
        "one_minute.html",
        "five_seconds.png",
        "fv_102.yaml",
        "stroke_test.csv",
    } <= written
    assert (tmp_path / "friction.csv").read_text().count("\n") == 3


def test_the_examples_are_what_their_script_makes(tmp_path):
    """Within the last digit, which a processor may round otherwise."""
    script = PROJECT / "examples" / "make_examples.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True, timeout=300)
    for name in ("one_minute.csv", "five_seconds.csv"):
        made, kept = (
            (folder / name).read_text().splitlines() for folder in (tmp_path, script.parent)
        )
        assert (script.parent / name).stat().st_size < 200_000
        assert len(made) == len(kept)
        assert sum(one != other for one, other in zip(made, kept, strict=True)) < 10


def links():
    for page, text in PAGES.items():
        for target in sorted(set(re.findall(r"\]\(([^)\s]+)\)", text))):
            if not target.startswith("http"):
                yield pytest.param(page, target, id=f"{page.relative_to(PROJECT)}:{target}")


def anchors(page):
    headings = re.findall(r"^#+ (.+)$", PAGES[page], re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in headings}


@pytest.mark.parametrize(("page", "target"), links())
def test_links_lead_somewhere(page, target):
    path, _, anchor = target.partition("#")
    found = (page.parent / path).resolve() if path else page
    assert found.exists()
    if anchor:
        assert anchor in anchors(found)


def test_make_has_each_target_that_is_named():
    makefile = (PROJECT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    pages = [*PROJECT.glob("*.md"), *PROJECT.glob("*.rst"), *PROJECT.glob("doc/**/*.md")]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    named = set(re.findall(r"(?:`|^)make ([a-z-]+)", text, re.MULTILINE))
    assert {"demo", "test", "load", "soak"} <= named <= targets
    declared = re.findall(r"^([A-Z]+_ARGS) \?=", makefile, re.MULTILINE)
    assert [name for name in declared if f"$({name})" not in makefile] == []


EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NOTEBOOK = json.loads((EXAMPLES / "from_recording_to_decision.ipynb").read_text(encoding="utf-8"))


def test_it_goes_from_a_recording_to_a_decision(monkeypatch, capsys):
    """Jupyter shows what the last line of a cell is, unless it ends with a semicolon."""
    monkeypatch.chdir(EXAMPLES)
    names: dict[str, object] = {}
    shown = []
    for cell in NOTEBOOK["cells"]:
        if cell["cell_type"] != "code":
            continue
        source = "".join(cell["source"])
        *before, last = ast.parse(source).body
        if isinstance(last, ast.Expr) and not source.rstrip().endswith(";"):
            exec(compile(ast.Module(before, []), "cell", "exec"), names)
            shown.append(eval(compile(ast.Expression(last.value), "cell", "eval"), names))
        else:
            exec(compile(source, "cell", "exec"), names)
    plt.close("all")
    (picture,) = [one for one in shown if one is not None]
    png = picture._repr_png_()
    assert png.startswith(b"\x89PNG")
    assert struct.unpack(">II", png[16:24]) == (1210, 935)
    assert len(png) < 500_000
    coulomb = names["result"].parameters["coulomb_friction"]
    assert coulomb.value == pytest.approx(400.0, abs=coulomb.half_width)
    printed = capsys.readouterr().out
    assert "friction has grown" in printed
    assert "dead band 13.7 % of the travel" in printed
    assert "the record very strongly favours the first model, which is 1e" in printed
    low, high, middle = (names[name] for name in ("low", "high", "middle"))
    assert np.all(low <= high)
    assert np.mean((low <= middle) & (middle <= high)) > 0.9
    changes = names["again"].difference(names["result"])
    assert set(changes) >= {"coulomb_friction", "spring_constant", "sliding_friction"}
    assert all(abs(change) < half_width for change, half_width in changes.values())
    date = datetime(2026, 10, 1, 6, tzinfo=timezone.utc)
    assert names["again"].recording.start_time == pytest.approx(date.timestamp(), abs=1e-3)


def test_the_documentation_shows_its_main_picture():
    page = (EXAMPLES.parent / "doc" / "start" / "notebook.md").read_text(encoding="utf-8")
    assert "](../notebook.png)" in page
    picture = EXAMPLES.parent / "doc" / "notebook.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size < 100_000


def test_it_is_kept_without_results():
    """What a reader sees is what their own run gives."""
    for cell in NOTEBOOK["cells"]:
        assert cell.get("outputs", []) == []
        assert cell.get("execution_count") is None
