# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page of a folder and the reports of its valves: axe-core finds nothing wrong with them.

The pages of the dashboard are tested where they are served.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from browser import axe_violations, chromium

PROJECT = Path(__file__).resolve().parents[1]
EXAMPLES = PROJECT / "examples"


@pytest.fixture(scope="module")
def browser():
    with chromium() as one:
        yield one


@pytest.fixture(params=[(1400, "light"), (390, "light"), (1400, "dark")], ids=str)
def page(browser, request):
    width, theme = request.param
    size = {"width": width, "height": 900}
    one = browser.new_page(viewport=size, color_scheme=theme, bypass_csp=True)
    yield one
    one.close()


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """A folder with two recordings, one of which is refused, and what is written of it."""
    folder = tmp_path_factory.mktemp("plant")
    shutil.copy(EXAMPLES / "five_seconds.csv", folder / "FV-101.csv")
    (folder / "FV-102.csv").write_text("time_s,pressure_pa,position_m\n0,1,1\n1,1,1\n")
    valve = ["--valve", str(EXAMPLES / "fv_101.yaml")]
    words = ["identify-folder", folder, *valve, "--output", folder / "plant.html"]
    command = [sys.executable, "-m", "valve_friction_ros", *words]
    subprocess.run(command, check=False, timeout=100)
    return folder


def test_pages_of_a_folder_and_of_its_valves(page, reports):
    found = sorted(reports.rglob("*.html"))
    assert len(found) >= 2
    for path in found:
        page.goto(path.as_uri())
        assert axe_violations(page) == [], path.name
