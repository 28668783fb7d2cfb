"""A report page: escaped, self-contained, well-formed, and complete."""

import base64
import struct
from html.parser import HTMLParser

import pytest
from matplotlib.figure import Figure

from valve_friction_ros.reports import (
    Column,
    Page,
    Paragraph,
    Picture,
    Section,
    Table,
    render,
)

VOID = {"meta", "img"}


class Reader(HTMLParser):
    """Checks that what opens also closes, and gathers tags with their attributes and text."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.texts = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append((self.open[-1] if self.open else "", data))

    def of(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]

    def said(self, name):
        return [text for tag, text in self.texts if tag == name and text.strip()]


def picture():
    figure = Figure(figsize=(2, 1))
    figure.subplots().plot([0, 1])
    return Picture(figure, "Fig. <1>", 'a "line"')


TABLE = Table(
    (Column("name"), Column("F_c [N]", is_number=True)),
    (("low & slow", "152.7"), ("high", "606")),
    "friction",
    marked=(1,),
)
PAGE = Page(
    "Valve <FV-101>",
    "It </p> sticks & slips.",
    (
        Section("One", (Paragraph("<script>alert(1)</script>"), TABLE)),
        Section("Two", (picture(),)),
    ),
)


@pytest.fixture(scope="module")
def reader():
    reader = Reader(render(PAGE))
    assert reader.open == []
    return reader


def test_everything_is_there_and_escaped(reader):
    assert reader.said("h1") == ["Valve <FV-101>"]
    assert reader.said("title") == ["Valve <FV-101>"]
    assert reader.said("h2") == ["One", "Two"]
    assert reader.said("p") == ["It </p> sticks & slips.", "<script>alert(1)</script>"]
    assert reader.said("caption") == ["friction"]
    assert reader.said("th") == ["name", "F_c [N]"]
    assert reader.said("td") == ["low & slow", "152.7", "high", "606"]
    assert reader.said("figcaption") == ["Fig. <1>"]
    assert not reader.of("script")


def test_numbers_stand_at_the_right_and_marked_rows_are_marked(reader):
    assert [cell.get("class") for cell in reader.of("td")] == [None, "number"] * 2
    assert [row.get("class") for row in reader.of("tr")] == [None, None, "marked"]


def test_the_picture_is_in_the_page(reader):
    (image,) = reader.of("img")
    assert image["alt"] == 'a "line"'
    kind, _, data = image["src"].partition(",")
    assert kind == "data:image/png;base64"
    content = base64.b64decode(data, validate=True)
    assert content.startswith(b"\x89PNG")
    assert struct.unpack(">II", content[16:24]) == (260, 130)


def test_nothing_is_fetched(reader):
    text = render(PAGE)
    assert "http" not in text
    assert "url(" not in text
    assert "@import" not in text
    for _, attributes in reader.tags:
        for name in ("src", "href"):
            assert attributes.get(name, "#").startswith(("#", "data:"))


@pytest.mark.parametrize(("count", "links"), [(3, 0), (4, 4)])
def test_long_pages_have_contents_that_lead_somewhere(count, links):
    sections = tuple(Section(f"part {i}", ()) for i in range(count))
    reader = Reader(render(Page("t", "l", sections)))
    places = {f"#{attributes['id']}" for attributes in reader.of("section")}
    assert len(reader.of("a")) == links
    assert {attributes["href"] for attributes in reader.of("a")} <= places


def test_tables_with_holes_are_refused():
    with pytest.raises(ValueError, match="row 1 has 1 cells for 2"):
        Table(TABLE.columns, (("a", "1"), ("b",)))
    with pytest.raises(ValueError, match="marked row 2 does not exist"):
        Table(TABLE.columns, TABLE.rows, marked=(2,))
