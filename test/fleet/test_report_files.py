"""Reports that are written where the results are."""

from valve_friction_ros.fleet import with_reports_written
from valve_friction_ros.fleet.report_files import PAGE, report_name


def test_a_report_that_cannot_be_written_is_one_more_warning(tmp_path):
    (tmp_path / "reports").mkdir()
    row = {"valve": "/a", "report": "reports/a.html", "warnings": "short", PAGE: "<p>"}
    refused = {"valve": "/c", "error": "gap"}
    good, bad, none = with_reports_written([row, {**row, "report": "no/b.html"}, refused], tmp_path)
    assert (tmp_path / "reports" / "a.html").read_text() == "<p>"
    assert good == {"valve": "/a", "report": "reports/a.html", "warnings": "short"}
    assert bad["report"] is None
    assert bad["warnings"].startswith("short; no report: ")
    assert none == refused


def test_names_of_reports_differ_where_valves_do():
    names = {report_name("a/b.csv", valve) for valve in ("", "/x", "/X", "x")}
    names |= {report_name("a_b.csv", ""), report_name("a" * 300, "")}
    assert len(names) == 6
    assert max(map(len, names)) < 120
