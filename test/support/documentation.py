"""The README and the pages of the documentation, as they are written."""

import re
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
README = PROJECT / "README.md"
PAGES = {
    path: path.read_text(encoding="utf-8")
    for path in (README, *sorted((PROJECT / "doc").rglob("*.md")))
}
TEXT = "\n".join(PAGES.values())


def snippets(language, text=TEXT):
    """Blocks of a language, without the indentation of a list that they stand in."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    return [re.sub(rf"^{indent}", "", body, flags=re.MULTILINE) for indent, body in found]
