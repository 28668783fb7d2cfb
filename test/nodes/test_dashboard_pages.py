# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The pages of the dashboard in a real browser, against live nodes."""

import contextlib
import re
import time
import urllib.request
from pathlib import Path
from urllib.parse import parse_qs, quote, urlsplit

import pytest
from browser import Tab, axe_violations, chromium
from histories import success
from live_nodes import NAMESPACE, NODE, SECOND, START, buffered
from local_server import free_port
from records import quick_record

from valve_friction_ros.health import (
    AlarmAction,
    AlarmKind,
    AlarmRequest,
    AlarmState,
    Condition,
    Level,
    StatusSignal,
)
from valve_friction_ros.history import (
    HistoryFile,
    KeptValve,
    follow_alarms,
    read_alarms,
    request_many,
)
from valve_friction_ros.model import HIGH_FRICTION

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

TAG = "<img src=x onerror=alert(1)>"
VALVE = f"/valve?node={quote(NODE)}"
SILENCE = 8.0
"""Long enough for a slow machine."""
EXCESS = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
PLANT = Path(__file__).parents[1] / "support" / "simulated_plant.py"


@pytest.fixture(scope="module")
def plant(shared):
    """An identifier whose tag is markup, nine made-up valves, and their dashboard's address."""
    port = free_port()
    shared.start_identifier({"valve_tag": TAG})
    shared.start("simulated_plant", script=PLANT, namespace=None)
    shared.dashboard = shared.start("dashboard", {"port": port, "silence": SILENCE}, namespace=None)
    shared.client.wait_until(
        lambda: "ready: open" in shared.dashboard.errors + shared.dashboard.output, "the server"
    )
    shared.address = f"http://127.0.0.1:{port}"
    shared.history = HistoryFile(shared.folder / "valve_friction_ros" / "history.sqlite")
    return shared


@pytest.fixture(scope="module")
def browser():
    """One context of it, which loads the scripts of the pages once."""
    with chromium() as one, one.new_context() as context:
        yield context


@pytest.fixture
def tab(plant, browser):
    """A tab, which must see no error and no other machine."""
    with contextlib.closing(Tab(browser, plant.address)) as one:
        yield one


def query_of(page):
    return {key: one for key, (one,) in parse_qs(urlsplit(page.url).query).items()}


def rows(page):
    return page.locator(".vf-row")


def wait_for_simulated_rows(page, count):
    """Wait for rows of the made-up valves; the level of the live one is left by other tests."""
    page.wait_for_function(
        "[...document.querySelectorAll('.vf-row')]"
        f".filter(row => row.innerText.includes('/area_')).length === {count}"
    )


def wait_for_rows(page, count):
    page.wait_for_function(f"document.querySelectorAll('.vf-row').length === {count}")


# Plant


def test_the_plant_is_there_with_the_worst_first(tab):
    page = tab.open("/")
    wait_for_rows(page, 10)
    states = page.locator(".vf-row .vf-chip").all_inner_texts()
    letters = [text.split()[0] for text in states]
    assert sorted(letters[:2]) == ["F", "S"]  # a letter of NE 107 and a word beside the colour
    assert all(len(text.split()) > 1 for text in states if text.split()[0] in "FSCM")
    row = rows(page).filter(has_text="FV-105").inner_text()
    assert "± " in row
    assert "limit 2027-02-11" in row
    assert page.get_by_role("status").first.inner_text().startswith("10 valves: 2 error")


def test_search_filter_and_order_are_in_the_address(tab):
    page = tab.open("/")
    wait_for_rows(page, 10)
    page.keyboard.press("/")
    page.keyboard.type("fv-10 baseline")
    page.wait_for_function("document.querySelectorAll('.vf-row').length < 10")
    page.get_by_role("button", name="warn").click()
    page.wait_for_function("document.querySelectorAll('.vf-row').length === 1")
    page.get_by_role("button", name="Sort by Valve").click()
    page.get_by_role("button", name="Tiles").click()
    page.wait_for_selector(".vf-tile")
    assert query_of(page) == {"q": "fv-10 baseline", "show": "warn", "sort": "tag", "view": "tiles"}
    page.reload()
    page.wait_for_selector(".vf-tile")
    assert page.locator(".vf-tile").count() == 1
    assert page.get_by_label("Search").input_value() == "fv-10 baseline"
    assert page.get_by_role("button", name="warn").get_attribute("aria-pressed") == "true"


def test_a_letter_of_ne_107_filters_and_an_empty_table_says_so(tab):
    page = tab.open("/?q=fv-1")
    wait_for_rows(page, 9)
    page.get_by_role("button", name="NE 107 S").click()
    wait_for_rows(page, 1)
    page.get_by_label("Search").fill("nothing is called so")
    page.get_by_text("No valve matches the filters.").wait_for()


def test_only_what_changes_is_sent(tab):
    """A table is not built anew each second: the frames of two seconds are small."""
    page = tab.page
    frames = []

    def listen(socket):
        socket.on("framereceived", lambda data: frames.append(len(data)))

    page.on("websocket", listen)
    tab.open("/")
    wait_for_rows(page, 10)
    page.wait_for_timeout(1500)
    frames.clear()
    page.wait_for_timeout(2000)
    assert frames
    assert sum(frames) < 3000  # ten rows take more than 5,000


def test_a_zone_and_a_theme_are_in_the_address(tab):
    page = tab.open("/?tz=Asia/Kolkata&theme=dark")
    wait_for_rows(page, 10)
    page.wait_for_function("document.querySelector('.vf-clock').innerText.endsWith(' IST')")
    assert page.evaluate("document.body.classList.contains('body--dark')")
    page.locator(".vf-row a").first.click()
    page.wait_for_url("**/valve?*")
    assert {"tz": "Asia/Kolkata", "theme": "dark"}.items() <= query_of(page).items()
    page.wait_for_function("document.querySelector('.vf-clock').innerText.endsWith(' IST')")


def test_keys_alone_lead_to_a_valve(tab):
    page = tab.open("/?q=fv-10")
    wait_for_rows(page, 9)
    page.get_by_role("button", name="Sort by Identified").focus()
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowDown")
    second = rows(page).nth(1).locator("a")
    assert second.evaluate("one => one === document.activeElement")
    assert second.evaluate("one => getComputedStyle(one).outlineStyle") == "solid"
    page.keyboard.press("Enter")
    page.wait_for_selector(".vf-valve")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize(
    "path", ["/", "/?view=tiles", "/alarms", "/alarms?view=events", VALVE, "/compare"]
)
def test_a_page_fits_its_window_and_axe_finds_nothing_wrong(tab, path, theme):
    join = "&" if "?" in path else "?"
    page = tab.open(f"{path}{join}theme={theme}")
    page.wait_for_selector(".vf-row, .vf-tile, .vf-valve, .vf-compare, .vf-alarms")
    for width in (2560, 1400, 390)[theme == "dark" :]:
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
        assert axe_violations(page) == []


# Text from outside


@pytest.mark.parametrize(
    "path", ["/", "/?view=tiles", VALVE, f"/compare?a={quote(NODE)}&b={quote(NODE)}"]
)
def test_text_from_outside_is_never_markup(tab, path):
    page = tab.open(path)
    page.get_by_text(TAG).first.wait_for()
    assert page.locator("img[src=x]").count() == 0


def test_an_address_is_text_from_outside_too(tab):
    page = tab.open(f"/valve?node={quote('/<img src=x onerror=alert(2)>')}&tz=<b>&theme=<i>")
    page.get_by_text("No message has been received from this valve.").wait_for()
    assert page.locator("img[src=x]").count() == 0
    page = tab.open("/?q=%22%3E%3Cscript%3Ealert(3)%3C/script%3E&sort=%3Cb%3E")
    page.get_by_text("No valve matches the filters.").wait_for()


# Valve: one after the other, as a person works with it


def test_what_is_missing_to_a_baseline_is_explained_and_offered(tab):
    page = tab.open(VALVE)
    page.locator(".vf-dl").get_by_text("buffered samples").wait_for(state="attached")
    page.get_by_role("button", name="Set baseline …").click()
    asked = page.locator(".vf-dialog")
    asked.get_by_text("nothing has been identified since the identifier started").wait_for()
    asked.get_by_text("Identify the valve.").wait_for()
    assert not axe_violations(page)
    asked.get_by_role("button", name="Identify").click()
    page.get_by_text("Identify: ").wait_for()


def is_full(status):
    """Whether the identifier holds a quick record; the made-up valves hold other counts."""
    return status.name.startswith(NODE) and buffered(status) == 1000


@pytest.fixture(scope="module")
def identified(plant):
    """Samples in the identifier's buffer."""
    plant.client.send_record(quick_record())
    plant.client.next_status(is_full, "1000 samples in the buffer")
    return plant


def press(page, name, answer):
    page.get_by_role("button", name=name).click()
    said = page.locator(".vf-answer:not(.hidden)")
    page.get_by_text(answer).first.wait_for()
    return said


@pytest.mark.usefixtures("identified")
def test_a_valve_is_identified_by_a_button(tab):
    page = tab.open(VALVE)
    page.locator("h1").get_by_text(TAG).wait_for()
    press(page, "Identify", "Identify: ")
    row = page.locator(".vf-parameters tr").filter(has_text="Coulomb friction")
    row.wait_for()
    assert "± " in row.inner_text()
    assert "identified" in row.inner_text()
    page.locator(".vf-sentence").get_by_text("no baseline").wait_for()
    page.locator(".vf-chart-trend canvas").wait_for()
    page.locator(".vf-long .vf-list tbody tr").first.wait_for()


TREND = 'getElement(Number(document.querySelector(".vf-chart-trend").id.slice(1)))'


@pytest.mark.usefixtures("identified")
def test_a_drag_over_the_trend_chooses_its_time(tab):
    page = tab.open(VALVE)
    chart = page.locator(".vf-chart-trend")
    chart.locator("canvas").wait_for()
    chart.scroll_into_view_if_needed()
    page.wait_for_function(f"{TREND}.drags")
    shown = f"{TREND}.chart.getOption().dataZoom[0].end"
    assert page.evaluate(shown) == 100
    box = chart.bounding_box()
    middle = box["y"] + 0.6 * box["height"]
    page.mouse.move(box["x"] + 0.3 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], middle, steps=5)
    page.mouse.up()
    page.wait_for_function(f"{shown} < 100")
    axis = f"{TREND}.chart.getOption().xAxis[0]"
    everything = page.get_by_role("button", name="all", exact=True).element_handle()
    page.wait_for_function("one => one.ariaPressed === 'false'", arg=everything)
    hour = page.get_by_role("button", name="1 h", exact=True)
    hour.click()
    page.wait_for_function("one => one.ariaPressed === 'true'", arg=hour.element_handle())
    page.wait_for_function(f"Math.abs({axis}.max - Date.now()) < 60000 && {shown} === 100")
    assert page.evaluate(f"{axis}.max - {axis}.min") == 3_600_000
    page.get_by_role("button", name="all", exact=True).click()
    page.wait_for_function(f"{axis}.max === null && {axis}.min === null")


def test_keys_of_experts_are_folded_away_and_opened_by_the_keyboard(tab):
    page = tab.open(VALVE)
    folds = page.locator(".vf-valve details")
    folds.nth(1).wait_for()
    names = folds.locator("summary").all_inner_texts()
    assert names == ["For experts: model fit", "For experts: node and samples"]
    key = folds.nth(1).get_by_text("buffered samples", exact=True)
    key.wait_for(state="hidden")
    folds.nth(1).locator("summary").focus()
    page.keyboard.press("Enter")
    key.wait_for(state="visible")


@pytest.mark.usefixtures("identified")
def test_a_baseline_is_set_only_when_it_is_agreed(tab):
    page = tab.open(VALVE)
    page.locator(".vf-parameters").wait_for()
    page.get_by_role("button", name="Set baseline …").click()
    asked = page.locator(".vf-dialog")
    asked.get_by_text("current", exact=True).wait_for()
    words = asked.inner_text()
    assert "none" in words
    assert "Coulomb friction 152" in words
    page.get_by_role("button", name="Cancel").click()
    asked.wait_for(state="detached")
    assert page.locator(".vf-sub").count() == 0
    page.get_by_role("button", name="Set baseline …").click()
    page.locator(".vf-dialog").get_by_role("button", name="Set baseline").click()
    page.get_by_text("Set baseline: baseline:").wait_for()
    page.locator(".vf-sub").first.wait_for()
    page.locator(".vf-fact-value").get_by_text("× 1.00").wait_for()


@pytest.mark.usefixtures("identified")
def test_a_baseline_is_restored_and_a_refusal_is_told(tab):
    page = tab.open(VALVE)
    page.locator(".vf-sub").first.wait_for()
    page.get_by_role("button", name="Restore baseline …").click()
    dialog = page.locator(".vf-dialog")
    page.wait_for_function("document.querySelectorAll('.vf-stack .vf-list tbody tr').length > 0")
    assert "none" in dialog.inner_text()
    dialog.get_by_role("button", name="Restore baseline").click()
    page.get_by_text("Restore baseline: baseline: none").wait_for()
    page.locator(".vf-sub").first.wait_for(state="detached")
    page.get_by_role("button", name="Restore baseline …").click()
    page.locator(".vf-dialog").get_by_role("button", name="Restore baseline").click()
    page.get_by_text("there is no ~/set_baseline to undo").wait_for()
    assert "vf-answer-error" in page.locator(".vf-answer:not(.hidden)").get_attribute("class")


@pytest.mark.usefixtures("identified")
def test_a_report_is_written_and_opened_as_a_page_without_scripts(tab):
    page = tab.open(VALVE)
    with page.expect_popup() as opened:
        press(page, "Write report", "Write report: written")
    report = opened.value
    page.locator(".vf-stack a").filter(has_text=".html").first.wait_for()
    link = page.get_by_role("link", name="Open the report")
    assert link.evaluate("one => one.href") == report.url
    report.wait_for_load_state()
    assert "friction" in report.locator("body").inner_text()
    with urllib.request.urlopen(report.url) as answer:
        assert "sandbox" in answer.headers["Content-Security-Policy"]
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
    report.close()


@pytest.mark.usefixtures("identified")
def test_a_recording_is_saved(tab):
    pytest.importorskip("rosbags", reason="bags need rosbags")
    page = tab.open(VALVE)
    press(page, "Save recording", "Save recording: ")
    page.locator(".vf-stack a").filter(has_text=".mcap").first.wait_for()


@pytest.mark.slow
def test_signals_are_heard_while_the_page_is_open(identified, tab):
    client, topic = identified.client, f"{NAMESPACE}/actuator_pressure"
    client.wait_until(lambda: client.node.count_subscribers(topic) == 1, "no other listener")
    page = tab.open(VALVE)
    client.wait_until(lambda: client.node.count_subscribers(topic) == 2, "the dashboard's ear")
    page.get_by_text("No samples have been received yet.").wait_for()
    client.send_record(quick_record(HIGH_FRICTION), START + 60 * SECOND)
    page.get_by_text("No samples have been received yet.").wait_for(state="hidden")
    page.goto("about:blank")
    client.wait_until(lambda: client.node.count_subscribers(topic) == 1, "the end of it")


def test_two_identifications_are_compared(identified, tab):
    client = identified.client
    for turn, record in enumerate((quick_record(), quick_record(HIGH_FRICTION))):
        assert client.trigger("clear").success
        client.send_record(record, START + (turn + 10) * 60 * SECOND)
        client.next_status(is_full, "1000 samples in the buffer")
        assert client.trigger("identify").success
    page = tab.open(VALVE)
    page.locator(".vf-long tbody tr").nth(1).wait_for()
    page.locator(".vf-long a").nth(1).click()  # the one before the last
    page.locator(".vf-compared").wait_for()
    row = page.locator(".vf-compared tr").filter(has_text="Coulomb friction").inner_text()
    assert "differs" in row  # of the record before, and of that with the high friction
    page.get_by_role("combobox", name="Valve of side B").click()
    page.get_by_role("option").filter(has_text="FV-103").click()
    page.wait_for_url("**/compare?*fv_103*")
    page.locator(".vf-compared").get_by_text("FV-103").first.wait_for()


@pytest.mark.usefixtures("identified")
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_wrong_with_what_is_known_of_a_valve(tab, theme):
    """Parameters, trend, identifications, a dialog and a comparison."""
    page = tab.open(f"{VALVE}&theme={theme}")
    press(page, "Identify", "Identify: ")
    page.locator(".vf-parameters").wait_for()
    page.locator(".vf-long tbody tr").first.wait_for()
    page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    assert axe_violations(page) == []
    page.get_by_role("button", name="Set baseline …").click()
    page.locator(".vf-dialog").get_by_text("current", exact=True).wait_for()
    assert axe_violations(page) == []
    page.get_by_role("button", name="Cancel").click()
    page = tab.open(f"/compare?a={quote(NODE)}&b={quote(NODE)}&theme={theme}")
    page.locator(".vf-compared").wait_for()
    assert axe_violations(page) == []


def test_an_alarm_is_acknowledged_with_a_name_and_exported(identified, tab):
    """A baseline of a quarter of the friction makes an alarm; its tag is markup, and stays text."""
    identified.client.set_parameters(NODE, {"baseline_coulomb_friction": 40.0})
    assert identified.client.trigger("identify").success
    page = tab.open("/alarms")
    row = page.locator("tr", has_text="friction high")
    row.wait_for()
    assert "Replace the packing" in row.inner_text()
    assert not page.get_by_text("No current alarms.").count()
    row.get_by_role("button", name="Acknowledge").click()
    page.get_by_role("button", name="Confirm").click()
    page.get_by_text("who is empty").wait_for()
    row.get_by_role("button", name="Acknowledge").click()
    page.get_by_label("Your name").fill("A. Operator")
    page.get_by_role("button", name="Confirm").click()
    page.get_by_text("friction high: acknowledged").first.wait_for()
    row.get_by_text("acknowledged by A. Operator").wait_for()
    assert axe_violations(page) == []
    row.get_by_role("button", name="More").click()
    page.get_by_label("Your name").wait_for()
    assert axe_violations(page) == []
    page.get_by_role("button", name="Cancel").click()
    export = page.get_by_role("link", name="CSV").get_attribute("href")
    with urllib.request.urlopen(identified.address + export) as answer:
        lines = answer.read().decode().splitlines()
    assert "friction_high" in lines[1]
    assert "A. Operator" in lines[1]
    identified.client.set_parameters(NODE, {"baseline_coulomb_friction": float("nan")})


MANY = 200


@pytest.fixture(scope="module")
def many(plant):
    """Alarms of two hundred valves in the history."""
    for number in range(MANY):
        valve = KeptValve(f"/many/fv_{number}/identifier", f"MANY-{number}")
        follow_alarms(plant.history, valve, {AlarmKind.FRICTION_HIGH: EXCESS}, time.time_ns())


@pytest.mark.usefixtures("many")
@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("/alarms?area=/many", ".vf-alarm-list tbody tr"),
        ("/?q=/many", ".vf-row"),
        ("/?q=/many&view=tiles", ".vf-tile"),
    ],
)
def test_of_many_those_near_the_view_are_drawn(tab, path, line):
    """All come as the page is scrolled."""
    page = tab.open(path)
    lines = page.locator(line)
    page.get_by_text("more below").wait_for()
    assert 0 < lines.count() < MANY
    while (count := lines.count()) < MANY:
        page.mouse.wheel(0, 20_000)
        page.wait_for_function(f"document.querySelectorAll('{line}').length > {count}")
    page.get_by_text("more below").wait_for(state="detached")


def test_an_alarm_of_a_valve_without_alarm_services_is_answered(plant, tab):
    """An identifier beside twenty others offers none; it follows the file of the history."""
    node = "/crowd/fv_1/identifier"
    valve = KeptValve(node, "CROWD-1")
    follow_alarms(plant.history, valve, {AlarmKind.FRICTION_HIGH: EXCESS}, time.time_ns())
    page = tab.open("/alarms?area=/crowd")
    row = page.locator("tr", has_text="friction high")
    row.get_by_role("button", name="Acknowledge").click()
    page.get_by_label("Your name").fill("A. Operator")
    page.get_by_role("button", name="Confirm").click()
    row.get_by_text("acknowledged by A. Operator").wait_for()
    assert (
        read_alarms(plant.history, node)[AlarmKind.FRICTION_HIGH].state is AlarmState.ACKNOWLEDGED
    )
    row.get_by_role("link", name="CROWD-1").click()  # its identifier is not heard
    card = page.get_by_role("region", name="Alarms")
    card.locator(".vf-alarm", has_text="acknowledged").wait_for()
    card.get_by_role("button", name="Take out of service").click()
    page.get_by_label("Your name").fill("A. Operator")
    page.get_by_role("button", name="Confirm").click()
    card.locator(".vf-alarm", has_text="out of service until").first.wait_for()
    card.get_by_role("button", name="More: friction high").click()
    page.get_by_label("Comment", exact=True).fill("half a sen")
    back = AlarmRequest(AlarmAction.PUT_BACK, "B")
    request_many(plant.history, [(valve, AlarmKind.STUCK)], back, time.time_ns())
    card.get_by_text("Friction low, whole valve, data quality, positioner: out of").wait_for()
    assert page.get_by_label("Comment", exact=True).input_value() == "half a sen"
    page = tab.open("/alarms?area=/crowd&tz=Asia/Tokyo")
    row = page.locator("tr", has_text="friction high")
    until = re.compile(r"until \S+ \d\d:\d\d JST$")
    row.get_by_text(until).wait_for()
    row.get_by_role("button", name="More").click()
    page.locator(".vf-dialog-title").get_by_text(until).wait_for()
    page.get_by_role("button", name="Cancel").click()
    page.locator("tr", has_text="4 alarms").get_by_role("button", name="More").click()
    page.locator(".vf-dialog-title").get_by_text("CROWD-1, all alarms: out of").wait_for()
    page.get_by_label("Your name").fill("A. Operator")
    page.get_by_role("button", name="Confirm").click()
    page.get_by_text("friction high: unacknowledged; friction low, whole valve").wait_for()
    page.locator("tr", has_text="4 alarms").wait_for(state="detached")


def test_of_a_valve_only_in_the_history_its_last_state_and_first_what_waits(plant, tab):
    valve, now = KeptValve("/past/fv_1/identifier", "PAST-1"), time.time_ns()
    plant.history.add(success(valve=valve))
    found = {AlarmKind.STUCK: EXCESS, AlarmKind.FRICTION_HIGH: EXCESS}
    follow_alarms(plant.history, valve, found, now - SECOND)
    shelve = AlarmRequest(AlarmAction.SHELVE, "B", duration=3600.0)
    request_many(plant.history, [(valve, AlarmKind.FRICTION_HIGH)], shelve, now)
    page = tab.open(f"/valve?node={quote(valve.name)}")
    page.locator(".vf-parameters").get_by_text("Coulomb friction").wait_for()
    page.get_by_text("Last in the history: friction normal").wait_for()
    row = tab.open("/?q=PAST-1").locator(".vf-row")
    row.get_by_text("friction normal").wait_for()
    row.get_by_text("150.0").wait_for(state="attached")
    compared = tab.open(f"/compare?a={quote(valve.name)}&b={quote(valve.name)}")
    compared.locator(".vf-compared tr", has_text="method").get_by_text("bench").first.wait_for()
    page = tab.open("/alarms?area=/past")
    page.locator("tbody tr:first-child").get_by_text("stuck").wait_for()
    page.locator("tbody tr:last-child").get_by_text("friction high").wait_for()


def test_what_cannot_be_called_says_so(tab):
    page = tab.open(f"/valve?node={quote('/area_1/fv_103/identifier')}")
    press(page, "Identify", "is not available: start the identifier of this valve")
    page = tab.open(f"/valve?node={quote('/no such name!')}")
    press(page, "Identify", "cannot be called")


# Restarts, the last of this file


@pytest.mark.slow
def test_an_identifier_that_ends_falls_silent_and_comes_back(plant, tab):
    page = tab.open(VALVE)
    page.locator(".vf-chip").first.wait_for()
    plant.kill(next(one for one in plant.nodes if one.name.endswith("/identifier")))
    page.locator(".vf-valve-name .vf-chip").get_by_text("silent").wait_for()
    plant.start("identifier", {"valve_tag": TAG, "input_timeout": 600.0})
    page.locator(".vf-valve-name .vf-chip").get_by_text("silent").wait_for(state="detached")


def test_ctrl_c_ends_it_and_open_pages_heal_when_it_is_back(plant, tab):
    page = tab.open("/?show=error&sort=tag")
    wait_for_simulated_rows(page, 2)
    parameters = {"port": urlsplit(plant.address).port, "silence": SILENCE}
    plant.client.watched.clear()
    plant.dashboard.interrupt()
    try:
        plant.dashboard.require_good_end()  # exit code 0, and no traceback
        page.get_by_role("alert").get_by_text("No connection").wait_for()
    finally:  # the other tests visit it, too
        plant.nodes.remove(plant.dashboard)
        plant.dashboard = plant.start("dashboard", parameters, namespace=None)
    page.get_by_role("alert").get_by_text("No connection").wait_for(state="detached")
    wait_for_simulated_rows(page, 2)
    assert query_of(page) == {"show": "error", "sort": "tag"}


def test_a_click_means_the_alarm_under_it_when_another_has_just_come(plant, tab):
    """The server is ahead of the rows in the browser, which here get no news."""
    for number in (1, 2):
        valve = KeptValve(f"/late/fv_{number}/identifier", f"LATE-{number}")
        follow_alarms(plant.history, valve, {AlarmKind.STUCK: EXCESS}, time.time_ns())
        if number == 1:
            page = tab.open("/alarms?area=/late")
            row = page.locator("tr", has_text="LATE-1")
            row.wait_for()
            page.evaluate(
                "getElement(Number(document.querySelector('.vf-alarms').id.slice(1))).update = "
                "() => { window.hasNews = true }"
            )
    page.wait_for_function("window.hasNews")
    row.get_by_role("button", name="Acknowledge").click()
    page.locator(".vf-dialog-title").get_by_text("LATE-1, stuck").wait_for()
    page.get_by_role("button", name="Cancel").click()
    first = KeptValve("/late/fv_1/identifier", "LATE-1"), AlarmKind.STUCK
    request_many(plant.history, [first], AlarmRequest(AlarmAction.ACKNOWLEDGE, "B"), time.time_ns())
    page.evaluate("window.hasNews = false")
    page.wait_for_function("window.hasNews")
    row.get_by_role("button", name="Acknowledge").click()
    page.get_by_text("The alarm has changed: LATE-1, stuck: acknowledged").wait_for()
