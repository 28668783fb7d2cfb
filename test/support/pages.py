# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Report pages, read as a browser reads them."""

import base64
import re
from html.parser import HTMLParser

_VOID = {"meta", "img", "source"}
_INLINE = {"sub", "span"}
_STATUS = ("div", "strong", "small")
PNG = b"\x89PNG\r\n\x1a\n"


class PageReader(HTMLParser):
    """Reads one page; what opens must close. A subscript is read as F_c, a minus sign as it is."""

    def __init__(self, text):
        super().__init__()
        self._open = []
        self._goes_on = False
        self.text = text
        self.tags = []
        """Each tag with its attributes."""
        self.order = []
        """Tag and text of each piece of text, in the order of the page."""
        self.tables = []
        """Rows of each table, each a tuple of cells."""
        self.feed(text)
        self.close()
        assert self._open == []
        self.order = [(tag, told.strip()) for tag, told in self.order if told.strip()]
        self.images = self.of("img")
        self.addresses = [
            attributes[name]
            for _, attributes in self.tags
            for name in ("src", "href", "srcset")
            if name in attributes
        ]

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in _VOID:
            self._open.append(tag)
        self._goes_on = tag in _INLINE
        if tag == "sub":
            self.handle_data("_")
            self._goes_on = True
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append(())
        elif tag in {"td", "th"}:
            self.tables[-1][-1] += ("",)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag
        self._goes_on = tag in _INLINE

    def handle_data(self, data):
        tag = next((one for one in reversed(self._open) if one not in _INLINE), "")
        if tag in {"td", "th"}:
            row = self.tables[-1][-1]
            self.tables[-1][-1] = (*row[:-1], row[-1] + data)
        if tag == "style":
            return
        if self._goes_on and self.order and self.order[-1][0] == tag:
            self.order[-1] = (tag, self.order[-1][1] + data)
        else:
            self.order.append((tag, data))
        self._goes_on = False

    def of(self, name):
        """The attributes of every tag of this name."""
        return [attributes for tag, attributes in self.tags if tag == name]

    def said(self, tag):
        """All texts that stand in such a tag."""
        return [text for where, text in self.order if where == tag]

    @property
    def lead(self):
        """What the page says first, below its title and its status."""
        told = [piece for piece in self.order if piece[0] not in {"title", *_STATUS}]
        assert told[0][0] == "h1"
        assert told[1][0] == "p"
        return told[1][1]

    @property
    def status(self):
        """Colour, sign, words and addition of the status, which stands right below the title."""
        (colour,) = (
            one["class"].split()[1] for one in self.of("div") if one["class"].startswith("status")
        )
        first = [tag for tag, _ in self.order].index("h1") + 1
        told = self.order[first : first + 3]
        assert [tag for tag, _ in told] == [*_STATUS]
        return (colour, *(text for _, text in told))

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
        written = re.sub(r"base64,[\w+/=]+", "", self.text)  # pixels may spell anything
        assert "http" not in written
        assert "<script" not in written
        assert all(
            address.startswith(("#", "data:image/png;base64,")) for address in self.addresses
        )
        assert all(len(image["alt"]) > 10 for image in self.images)
        assert all(picture.startswith(PNG) for picture in self.pictures())
