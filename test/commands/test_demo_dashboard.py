# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`demo --dashboard` as a person meets it: a process, a browser, and Ctrl-C."""

import contextlib
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from browser import Tab, chromium
from processes import processes_with

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1500)]
HERE = Path(__file__).parent
PATIENCE = 600.0


IN_THE_BACKGROUND = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]
"""What a script does with a command before `&`: Ctrl-C is ignored."""


@pytest.fixture(params=[[]], ids=["as typed"])
def demo(request, ros_environment, tmp_path):
    """The running demo, whose temporary files are in `tmp_path`, and the address it opens."""
    log = tmp_path / "demo.log"
    folder = tmp_path / "temporary"
    folder.mkdir()
    more = {"TMPDIR": str(folder), "COLUMNS": "200", "PYTHONUNBUFFERED": "1"}
    environment = ros_environment | more
    environment.pop("PYTEST_CURRENT_TEST", None)  # NiceGUI behaves otherwise within a test
    with log.open("w") as stream:
        process = subprocess.Popen(
            [*request.param, sys.executable, HERE / "quick_demo.py", "demo", "--dashboard"],
            stdout=stream,
            stderr=subprocess.STDOUT,
            cwd=tmp_path,
            env=environment,
        )
    process.log, process.folder = log, folder

    def said(words):
        deadline = time.monotonic() + PATIENCE
        while not (match := re.search(words, log.read_text())):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline, f"no {words!r} in {log.read_text()}"
            time.sleep(0.05)
        return match[1]

    process.said = said
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(120)
        process.kill()


def ends_clean(demo, request):
    nodes = processes_with(str(demo.folder))
    assert len(nodes) > 10  # itself, the dashboard, and three nodes a valve
    demo.send_signal(request)
    assert demo.wait(120) == 0
    assert not processes_with(str(demo.folder))
    assert list(demo.folder.iterdir()) == []
    assert "Traceback" not in demo.log.read_text()


def test_three_valves_their_verdicts_and_a_clean_end(demo):
    address = demo.said(r"the dashboard is at (http://127\.0\.0\.1:\d+)/")
    with chromium() as browser, contextlib.closing(Tab(browser, address)) as tab:
        page = tab.open("/")
        page.set_default_timeout(1e3 * PATIENCE)
        for tag, state in (("FV-101", "good"), ("FV-102", "failure"), ("FV-103", "out of spec")):
            row = page.locator(".vf-row").filter(has_text=tag)
            row.locator(".vf-chip").get_by_text(state).wait_for()
        words = page.locator(".vf-row").all_inner_texts()
        assert "FV-101" in words[-1]  # the worst come first
        row = page.locator(".vf-row").filter(has_text="FV-102")
        assert float(row.locator(".vf-c-ratio b").inner_text()) > 2
        row.locator("a").click()
        page.locator(".vf-sentence").get_by_text("excess friction").wait_for()
        page.locator(".vf-chart-trend canvas").wait_for()
        page.get_by_text("No samples have been received yet.").wait_for(state="hidden")
    assert demo.said(r"(fv_103) \(leaking, F_c 90 N\): ERROR: friction collapsed")
    ends_clean(demo, signal.SIGINT)


@pytest.mark.parametrize(
    "demo", [[], IN_THE_BACKGROUND], indirect=True, ids=["as typed", "in the background"]
)
def test_sigterm_while_it_starts_leaves_nothing_behind(demo):
    demo.said(r"the dashboard is at (\S+)")
    ends_clean(demo, signal.SIGTERM)
