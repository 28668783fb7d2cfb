"""A report page: escaped, self-contained, well-formed, and complete."""

import base64
import struct

import pytest
from matplotlib.figure import Figure
from pages import PageReader

from valve_friction_ros.reports import (
    Colour,
    Column,
    Page,
    Paragraph,
    Picture,
    Section,
    Status,
    Table,
    render,
)
from valve_friction_ros.reports.typography import Verbatim, typeset


def picture(width=2):
    figure = Figure(figsize=(width, 1))
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
    return PageReader(render(PAGE))


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
    assert size(content) == (300, 150)


def size(png):
    return struct.unpack(">II", png[16:24])


@pytest.mark.parametrize(
    ("width", "narrow", "kind"),
    [(3.5, None, "half"), (7.0, (740, 200), None), (9.5, None, None)],
)
def test_a_wide_picture_is_laid_out_again_for_a_narrow_screen(width, narrow, kind):
    """Unless two stand beside each other anyway, or it holds many panels."""
    shown = picture(width)
    reader = PageReader(render(Page("t", "l", (Section("s", (shown,)),))))
    assert [one.get("class") for one in reader.of("figure")] == [kind]
    found = [base64.b64decode(one["srcset"].partition(",")[2]) for one in reader.of("source")]
    assert [size(png) for png in found] == ([] if narrow is None else [narrow])
    assert all("max-width" in one["media"] for one in reader.of("source"))
    assert size(shown.png) == (round(150 * width), 150)


def test_a_table_tells_each_cell_what_it_is():
    """A narrow screen shows the cells of a row below each other, each with its heading."""
    columns = tuple(map(Column, ("a", "b", "F_c")))
    wide, pairs = Table(columns, (("1", "2", "3"),)), Table(columns[:2], (("1", "2"),))
    reader = PageReader(render(Page("t", "l", (Section("s", (wide, pairs)),))))
    assert [one.get("class") for one in reader.of("table")] == ["cards", None]
    assert [one["data-title"] for one in reader.of("td")] == ["a", "b", "F_c", "a", "b"]
    assert "content: attr(data-title)" in reader.text


@pytest.mark.parametrize("colour", Colour)
def test_the_status_comes_first_with_a_sign_beside_its_colour(colour):
    page = Page("t", "lead", (), Status(colour, "Words <1>", "NE 107"), "2026-11-22")
    reader = PageReader(render(page))
    assert reader.status == (colour.name.lower(), colour.value, "Words <1>", "NE 107")
    assert reader.lead == "lead"
    assert reader.said("p") == ["lead", "2026-11-22"]
    assert len({one.value for one in Colour}) == len(Colour)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("F_c and (F_c + F_s)/k", "F<sub>c</sub> and (F<sub>c</sub> + F<sub>s</sub>)/k"),
        ("P_ref, σ_s, R²_s", "P<sub>ref</sub>, σ<sub>s</sub>, R²<sub>s</sub>"),
        ("F_0 is -20.5 N, -3 to 4", "F<sub>0</sub> is −20.5 N, −3 to 4"),
        ("2026-11-22, FV-101, 1e-05", "2026-11-22, FV-101, 1e-05"),
        ("F_c.csv, sliding_friction, warn_ratio", "F_c.csv, sliding_friction, warn_ratio"),
        ("a < b", "a &lt; b"),
        (Verbatim("F_c <-1>"), "F_c &lt;-1&gt;"),
    ],
)
def test_symbols_and_signs_are_those_of_print(text, shown):
    assert str(typeset(text)) == shown


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
    reader = PageReader(render(Page("t", "l", sections)))
    places = {f"#{attributes['id']}" for attributes in reader.of("section")}
    assert len(reader.of("a")) == links
    assert {attributes["href"] for attributes in reader.of("a")} <= places


def test_tables_with_holes_are_refused():
    with pytest.raises(ValueError, match="row 1 has 1 cells for 2"):
        Table(TABLE.columns, (("a", "1"), ("b",)))
    with pytest.raises(ValueError, match="marked row 2 does not exist"):
        Table(TABLE.columns, TABLE.rows, marked=(2,))
