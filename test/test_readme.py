"""The README: its Python can be pasted, and its links lead somewhere."""

import contextlib
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from valve_friction_ros.commands.main import run
from valve_friction_ros.records.yaml_file import read_yaml

PROJECT = Path(__file__).resolve().parents[1]
README = (PROJECT / "README.md").read_text(encoding="utf-8")


def test_the_notebook_section_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    section = README.partition("## From a notebook\n")[2].partition("\n## ")[0]
    snippets = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    assert len(snippets) == 2
    names: dict[str, object] = {}
    for snippet in snippets:
        exec(compile(snippet, "README.md", "exec"), names)
    printed = capsys.readouterr().out
    assert printed.startswith("parameter ")
    assert "friction is" in printed or "coulomb friction" in printed
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
    blocks = "".join(re.findall(r"```sh\n(.*?)```", README, re.DOTALL)).replace("\\\n", " ")
    commands = re.findall(r"^\.venv/bin/valve_friction (.*)$", blocks, re.MULTILINE)
    return [each for each in commands if not each.startswith(NEED_NODES)]


def test_options_describe_a_table_as_its_valve_file_does(tmp_path, monkeypatch, capsys):
    """The numbers are equal, and the options lack nothing that the section `columns:` says."""
    monkeypatch.chdir(PROJECT)
    (line,) = (each for each in offline_commands() if "--time-column" in each)
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
        assert run([*words, "--method", "refined", "--json"]) == 0
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
    assert "coulomb_friction   400" in capsys.readouterr().out
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


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\]\(([^)]+)\)", README))))
def test_links_lead_somewhere(target):
    if target.startswith("http"):
        pytest.skip("another site")
    path, _, anchor = target.partition("#")
    if path:
        assert (PROJECT / path).exists()
    else:
        headings = re.findall(r"^#+ (.+)$", README, re.MULTILINE)
        slugs = {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in headings}
        assert anchor in slugs
