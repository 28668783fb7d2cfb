# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command: what it writes, what it says last, and what it refuses."""

import re

import pytest
from pages import PageReader
from paper import command
from paper.checks import all_checks

from valve_friction_ros.commands import reproduce_paper
from valve_friction_ros.commands.main import run

PICTURES = {
    "excitations",
    "figure_2_graphite",
    *(f"figure_{number}" for number in (1, 2, 5, 6, 7, 8, 9)),
    *(f"figure_{number}_{name}" for number in (3, 4) for name in ("low", "high", "graphite")),
    "validation_graphite_sine",
    "validation_graphite_isa",
}


@pytest.fixture(scope="module")
def page(reproduced):
    return PageReader((reproduced.output / "reproduction.html").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_the_report_and_every_figure_are_written(reproduced):
    assert reproduced.code == 0
    names = {path.name for path in reproduced.output.iterdir()}
    assert names == {"reproduction.html", *(f"{name}.png" for name in PICTURES)}
    for name in PICTURES:
        assert (reproduced.output / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_the_last_line_counts_and_names(reproduced):
    checks = all_checks(reproduced.programme)
    missed = [check.name for check in checks if not check.matched]
    count, _, names = reproduced.lines[-1].partition("; not matched: ")
    assert count == f"{len(checks) - len(missed)} of {len(checks)} matched"
    assert names == "; ".join(missed) + "."


def test_every_item_has_its_section_and_its_checks(reproduced, page):
    titles = page.said("h2")
    assert titles[0] == "Not matched"
    assert [title.partition(".")[0] for title in titles[1:]] == [str(n) for n in range(1, 11)]
    checks = all_checks(reproduced.programme)
    assert {check.item for check in checks} == set(range(1, 11))
    missed = [check for check in checks if not check.matched]
    cells = page.said("td")
    assert cells.count("✓") == len(checks) - len(missed)
    assert cells.count("✗") == 2 * len(missed)
    for check in checks:
        assert cells.count(typeset(check.name)) == 1 + (not check.matched)
    assert len(page.images) == len(PICTURES)


def test_the_lead_counts_and_the_first_table_lists(reproduced, page):
    """Twelve items do not belong into a sentence."""
    checks = all_checks(reproduced.programme)
    missed = [check.name for check in checks if not check.matched]
    assert len(missed) > 1
    assert page.lead.endswith(f" {len(checks) - len(missed)} of {len(checks)} matched.")
    assert not any(name in page.lead for name in missed)
    assert [row[1] for row in page.tables[0][1:]] == [typeset(name) for name in missed]


def typeset(text):
    """As the page writes it."""
    return re.sub(r"(?<![\w.-])-(?=\d)", "−", text)


def test_the_page_needs_no_other_file(reproduced):
    text = (reproduced.output / "reproduction.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|<script|<link|url\(", text)


def test_the_noise_of_the_run_is_stated(page):
    assert any("1 µm and 5 Pa (standard deviations), seed 3" in text for text in page.said("p"))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--seed", "-1"], "--seed must not be negative"),
        (["--position-noise-um", "-1"], "--position-noise-um must be finite and not negative"),
        (["--pressure-noise-pa", "nan"], "--pressure-noise-pa must be finite and not negative"),
        (["--config", "nowhere"], "nowhere/bench_low.yaml: cannot be read"),
    ],
)
def test_wrong_options_are_refused_in_one_line(tmp_path, monkeypatch, capsys, arguments, told):
    monkeypatch.chdir(tmp_path)
    assert run(["reproduce-paper", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("valve_friction reproduce-paper: ")
    assert told in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_is_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "taken").write_text("")
    assert run(["reproduce-paper", "--output", str(tmp_path / "taken")]) == 2
    told = f"{tmp_path / 'taken'}: not a folder: give --output another name"
    assert capsys.readouterr().err == f"valve_friction reproduce-paper: {told}\n"


def test_noise_that_hides_everything_is_refused_with_the_packing(tmp_path, capsys):
    options = ["reproduce-paper", "--output", str(tmp_path), "--position-noise-um", "1000"]
    assert run(options) == 2
    refusal = capsys.readouterr().err.splitlines()[-1]
    assert refusal.startswith(
        "valve_friction reproduce-paper: packing low: sampling is too slow for the motion"
    )
    assert list(tmp_path.iterdir()) == []


def test_noise_of_the_command_line_replaces_the_configured(monkeypatch, tmp_path):
    seen = {}

    def refuse(benches, *_):
        seen.update({name: bench.noise for name, bench in benches.items()})
        raise ValueError("enough")

    monkeypatch.setattr(command, "run_programme", refuse)
    options = ["--position-noise-um", "0", "--pressure-noise-pa", "7", "--seed", "4"]
    assert run(["reproduce-paper", "--output", str(tmp_path), *options]) == 2
    assert {(one.position, one.pressure, one.seed) for one in seen.values()} == {(0.0, 7.0, 4)}


def test_an_installation_without_it_says_where_it_is(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(
        reproduce_paper, "__file__", str(tmp_path / "package" / "commands" / "a.py")
    )
    assert run(["reproduce-paper", "--output", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert told.startswith("valve_friction reproduce-paper: the reproduction is not part of the")
    assert told.endswith("where it lies in examples/paper\n")
