"""The page of many valves: their order, their cells, and text that stays text."""

import math
from html.parser import HTMLParser

import pytest

from valve_friction_ros.fleet import COLUMNS, ranked
from valve_friction_ros.fleet.page import page_text
from valve_friction_ros.fleet.picture import HEIGHT, WIDTH, signature_points
from valve_friction_ros.fleet.ranking import reaches, status_of
from valve_friction_ros.health import Level
from valve_friction_ros.model import Recording

EVIL = "<script>alert(1)</script> & \"x' {{ 1 + 1 }}"


def row(name, level="OK", signal="", ratio=None, dead_band=0.2, **cells):
    empty = dict.fromkeys((*COLUMNS, "picture"))
    return empty | {
        "recording": name,
        "valve": "",
        "level": level,
        "ne_107": signal,
        "ratio": ratio,
        "dead_band_of_travel": dead_band,
        "message": f"about {name}",
        **cells,
    }


FLEET = [
    row("refused", None, None, None, None, message=None, error="too short"),
    row("unknown"),
    row("halved", ratio=0.6),
    row("grown", "WARN", "M", 1.4),
    row("same", ratio=1.0, dead_band=0.1),
    row("same but wide", ratio=1.0, dead_band=0.3),
    row("excessive", "ERROR", "F", 2.1),
    row("collapsed", "ERROR", "S", 0.2),
    row("doubtful", "WARN", "C", 1.1),
    row("perhaps", ratio=1.3),
]
ORDER = [
    *("collapsed", "excessive", "grown", "doubtful", "halved", "perhaps"),
    *("same but wide", "same", "unknown", "refused"),
]


class Cells(HTMLParser):
    """Text of each row of the table, links, and the number of scripts."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.links, self.scripts, self.outside = [], [], 0, []
        self._is_cell = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self.rows[-1].append("")
            self._is_cell = True
        elif tag == "a":
            self.links.append(found["href"])
        self.scripts += tag == "script"
        self.outside += [found[name] for name in ("src", "srcset") if name in found]
        assert not [name for name in found if name.startswith("on")]

    def handle_endtag(self, tag):
        self._is_cell &= tag != "td"

    def handle_data(self, data):
        if self._is_cell:
            self.rows[-1][-1] += data


CHANGED = {"findings_level": "WARN", "findings": "WARN: the spring constant has changed"}


def test_a_valve_with_a_finding_comes_before_a_normal_one():
    changed = row("b", ratio=1.0) | CHANGED
    rows = ranked([row("a", ratio=1.1), changed])
    assert [one["recording"] for one in rows] == ["b", "a"]
    assert reaches(changed, Level.WARN)
    assert not reaches(changed, Level.ERROR)
    lines = [line for line in Cells(page_text(rows, "plant")).rows if line]
    assert lines[0][-1].endswith("WARN: the spring constant has changed")


def test_the_order():
    assert [one["recording"] for one in ranked(FLEET)] == ORDER


@pytest.mark.parametrize(
    ("given", "word"),
    [
        (FLEET[0], "refused"),
        (FLEET[1], "no comparison"),
        (FLEET[2], "perhaps fallen"),
        (FLEET[4], "normal"),
        (FLEET[7], "collapsed"),
        (FLEET[8], "check"),
        (FLEET[9], "perhaps grown"),
        (row("x", ratio=0.49), "perhaps fallen"),
        (row("x", "WARN", "M", 0.7), "fallen"),
        (row("x", "WARN", "C", 0.7), "perhaps fallen"),
        (row("x", "WARN", "C", 1.4), "perhaps grown"),
        (row("x", ratio=1.0) | CHANGED, "changed"),
        (row("x", ratio=3.0, level="ERROR", ne_107="F") | CHANGED, "excessive"),
    ],
)
def test_the_status(given, word):
    assert status_of(given).word == word


def test_a_page_in_this_order():
    page = Cells(page_text(FLEET, "plant"))
    lines = [line for line in page.rows if line]
    assert [line[2].strip() for line in lines] == ORDER
    assert [line[0] for line in lines] == [str(number) for number in range(1, 11)]
    assert lines[0][4:6] == ["0.20", "20 %of travel"]
    assert [line[-1] for line in lines][-2:] == ["about unknown", "too short"]
    assert page.scripts == 1
    assert page.outside == []


def test_text_from_outside_is_text():
    report = "plant_reports/a b&<.html"
    evil = row(EVIL, valve=EVIL, ratio=1.0, message=EVIL, report=report)
    page = Cells(page_text([evil, row("x", None, error=EVIL)], EVIL))
    lines = [line for line in page.rows if line]
    assert lines[0][2].strip() == f"{EVIL} {EVIL}"
    assert [line[-1] for line in lines] == [EVIL, EVIL]
    assert page.scripts == 1
    assert page.links == ["plant_reports/a%20b%26%3C.html"]


def test_a_page_of_no_valves():
    assert "Friction of 0 valves" in page_text([], "plant")


def test_the_picture():
    """It stays within its frame, and a point is kept only where the line has moved."""
    drive = [1e5 + 4e4 * math.sin(number / 5000) for number in range(100_000)]
    position = [max(0.0, (one - 1e5) / 4e6) for one in drive]
    points = [
        tuple(map(float, point.split(",")))
        for point in signature_points(Recording(0.01, drive, position)).split()
    ]
    assert 200 < len(points) <= 500
    assert {round(x) for x, _ in points} >= {2, WIDTH // 2, WIDTH - 2}
    assert all(0 <= x <= WIDTH and 0 <= y <= HEIGHT for x, y in points)
    assert points[0][1] == pytest.approx(HEIGHT - 1)  # a closed valve is drawn at the bottom


def test_the_picture_of_a_stem_at_rest():
    assert signature_points(Recording(0.1, [1e5] * 3, [0.0] * 3)) == f"1.0,{HEIGHT - 1:.1f}"
