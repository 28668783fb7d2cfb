"""Text as a page shows it: symbols with subscripts, and the minus sign."""

import html
import re

from jinja2.filters import do_mark_safe

__all__ = ["Verbatim", "typeset"]

_SYMBOL = re.compile(r"(?<![\w.])([FPRSTakv]|σ|R²)_(ref|[a-z0-9])(?!\w|\.\w)")
_MINUS = re.compile(r"(?<![\w.-])-(?=\d)")


class Verbatim(str):
    """Text from outside, such as the name of a file: it is shown as it is."""

    __slots__ = ()


def typeset(text: str) -> str:
    """Escape a text, and set F_c with a subscript and -1 with a minus sign."""
    escaped = html.escape(text)
    if not isinstance(text, Verbatim):
        escaped = _MINUS.sub("−", _SYMBOL.sub(r"\1<sub>\2</sub>", escaped))
    return do_mark_safe(escaped)
