# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the server logs of refused log-ins, and what it compresses."""

import asyncio

import pytest
from quick_accounts import quick_account

from valve_friction_ros.dashboard.accounts import Access
from valve_friction_ros.dashboard.log_in import Sessions

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

import httpx
from starlette.responses import PlainTextResponse

from valve_friction_ros.dashboard.gate import Gate
from valve_friction_ros.dashboard.pages.server import LightlyPacked

ANNA = quick_account()
URL = "http://127.0.0.1:8080"


def test_refused_log_ins_are_logged_within_a_bound():
    access, lines = Access(accounts=(ANNA,)), []
    gate = Gate(None, access, Sessions([ANNA], 60.0, lambda: 0.0), lines.append)

    async def visit():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(gate), base_url=URL) as client:
            form = {"name": "anna\nroot has logged in" + "x" * 500, "password": "wrong"}
            return [(await client.post("/login", data=form)).status_code for _ in range(80)]

    assert asyncio.run(visit()) == [401] * 10 + [429] * 70
    assert len(lines) == 60
    assert "wrong name or password" in lines[0]
    assert "too many attempts" in lines[10]
    assert all(line.isprintable() and len(line) < 200 for line in lines)
    assert lines[0].startswith("refused log-in of ")


@pytest.mark.parametrize(
    ("path", "encoding"), [("/", "gzip"), ("/files/bags/a.mcap", None), ("/filesystem", "gzip")]
)
def test_reports_and_bags_are_not_compressed(path, encoding):
    packed = LightlyPacked(PlainTextResponse("a" * 5000))

    async def visit():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(packed), base_url=URL) as client:
            return await client.get(path)

    answer = asyncio.run(visit())
    assert answer.headers.get("content-encoding") == encoding
    assert answer.text == "a" * 5000
