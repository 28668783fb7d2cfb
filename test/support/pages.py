"""Report pages, read as a browser reads them."""

import base64
from html.parser import HTMLParser

_VOID = {"meta", "img"}
PNG = b"\x89PNG\r\n\x1a\n"


class PageReader(HTMLParser):
    """Reads one page; what opens must close."""

    def __init__(self, text):
        super().__init__()
        self._open = []
        self.text = text
        self.order = []
        """Tag and text of each piece of text, in the order of the page."""
        self.images = []
        self.addresses = []
        self.tables = []
        """Rows of each table, each a tuple of cells."""
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag not in _VOID:
            self._open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append(())
        elif tag in {"td", "th"}:
            self.tables[-1][-1] += ("",)
        elif tag == "img":
            self.images.append(attributes)
        self.addresses += [attributes[name] for name in ("src", "href") if name in attributes]

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        tag = self._open[-1] if self._open else ""
        if tag in {"td", "th"}:
            row = self.tables[-1][-1]
            self.tables[-1][-1] = (*row[:-1], row[-1] + data)
        if data.strip() and tag != "style":
            self.order.append((tag, data.strip()))

    def said(self, tag):
        """All texts that stand in such a tag."""
        return [text for where, text in self.order if where == tag]

    @property
    def lead(self):
        """What the page says first, below its title."""
        told = [piece for piece in self.order if piece[0] != "title"]
        assert told[0][0] == "h1"
        assert told[1][0] == "p"
        return told[1][1]

    def table(self, heading):
        """The rows below the headings of the table whose first heading this is, by first cell."""
        (table,) = (table for table in self.tables if table[0][0] == heading)
        rows = {row[0]: row[1:] for row in table[1:]}
        assert len(rows) == len(table) - 1
        return rows

    def pictures(self):
        """The bytes of each picture."""
        return [base64.b64decode(image["src"].partition(",")[2]) for image in self.images]

    def require_self_contained(self):
        """Nothing is fetched, and every picture is a PNG that says what it shows."""
        assert "http" not in self.text
        assert "<script" not in self.text
        assert all(
            address.startswith(("#", "data:image/png;base64,")) for address in self.addresses
        )
        assert all(len(image["alt"]) > 10 for image in self.images)
        assert all(picture.startswith(PNG) for picture in self.pictures())
