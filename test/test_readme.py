"""The README: its Python can be pasted, and its links lead somewhere."""

import re
from pathlib import Path

import pytest

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
