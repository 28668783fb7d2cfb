# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Connections that send no request, or only half of one, take the pages from nobody."""

import asyncio
import contextlib
import os
import resource
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from local_server import free_port
from waiting import PATIENCE, wait_until

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

import httpx
import websockets

from valve_friction_ros.dashboard import gate
from valve_friction_ros.dashboard.accounts import VARIABLE
from valve_friction_ros.dashboard.gate import (
    ARRIVAL_TIME,
    MOST_OF_A_CLIENT,
    ConnectionLog,
)

SCRIPT = Path(__file__).parents[1] / "support" / "guarded_page.py"
FILES = 1024
"""Files that the server may open: the usual limit of a shell."""
HALF = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"


class Page:
    """A running page in a process of few files."""

    def __init__(self, folder):
        self.port, self._output = free_port(), folder / "output.txt"
        hidden = {name: text for name, text in os.environ.items() if not name.startswith("PYTEST")}
        with self._output.open("w") as stream:
            self.process = subprocess.Popen(
                [sys.executable, SCRIPT, str(self.port)],
                cwd=folder,
                env=hidden | {VARIABLE: ""},
                stdout=stream,
                stderr=subprocess.STDOUT,
            )
        resource.prlimit(self.process.pid, resource.RLIMIT_NOFILE, (FILES, FILES))

    @property
    def output(self):
        return self._output.read_text()

    def opens(self, timeout=5.0):
        with contextlib.suppress(httpx.HTTPError):
            return "Operate" in httpx.get(f"http://127.0.0.1:{self.port}/", timeout=timeout).text
        return False

    def connect(self, source, sent=HALF):
        made = socket.create_connection(("127.0.0.1", self.port), PATIENCE, (source, 0))
        made.sendall(sent)
        return made

    def open_files(self):
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))


@pytest.fixture
def page(tmp_path):
    made = Page(tmp_path)
    try:
        until(made.opens, "the page")
        yield made
    finally:
        made.process.kill()
        made.process.wait()


@pytest.fixture
def opened():
    with contextlib.ExitStack() as stack:
        yield stack.enter_context


def until(condition, what, patience=PATIENCE):
    return wait_until(condition, lambda: what, patience, 0.05)


@pytest.mark.parametrize("source", ["127.0.0.2", "127.0.0.1"])
def test_1100_half_requests_do_not_take_the_pages(page, opened, source):
    """Neither from another client, nor from the client's own address."""
    before = page.open_files()
    for _ in range(1100):
        opened(page.connect(source))
    assert page.opens()
    assert page.open_files() <= before + MOST_OF_A_CLIENT + 1
    until(lambda: page.open_files() <= before + 2, "the end of them", ARRIVAL_TIME + 10.0)
    assert page.opens()
    lines = [line for line in page.output.splitlines() if source in line]
    assert len(lines) == 1, page.output
    assert lines[0] == f"a connection of {source} was ended: more than 256 were open"
    assert "Traceback" not in page.output


def time_until_the_end(made, slowly):
    """Time, s, after which the server ends a connection on which a header comes now and then."""
    begun = time.monotonic()
    made.settimeout(1.0)
    while time.monotonic() < begun + 3 * ARRIVAL_TIME:
        with contextlib.suppress(TimeoutError):
            try:
                made.send(slowly)
                if not made.recv(65536):
                    break
            except ConnectionError:
                break
    return time.monotonic() - begun


@pytest.mark.parametrize(("sent", "slowly"), [(b"", b""), (HALF, b""), (HALF, b"X-Slow: 1\r\n")])
def test_half_a_request_ends_after_ten_seconds(page, opened, sent, slowly):
    """Without a byte, as browsers do, which is not logged; within the headers, slow ones too."""
    made = opened(page.connect("127.0.0.2", sent))
    assert 0.9 * ARRIVAL_TIME < time_until_the_end(made, slowly) < 2 * ARRIVAL_TIME
    told = "a connection of 127.0.0.2 was ended: its request did not arrive within 10 s"
    assert (told in page.output) is bool(sent)


def test_pages_that_are_open_live_on(page, opened):
    """A WebSocket outlives the time for requests, and a crowd of its own address."""
    address = f"ws://127.0.0.1:{page.port}/_nicegui_ws/socket.io/?EIO=4&transport=websocket"

    async def visit():
        origin = f"http://127.0.0.1:{page.port}"
        async with websockets.connect(address, origin=origin, ping_interval=None) as one:
            assert (await one.recv()).startswith("0{")
            begun = time.monotonic()
            for _ in range(400):
                opened(page.connect("127.0.0.1"))
            await one.send("40")
            while time.monotonic() < begun + ARRIVAL_TIME + 5.0:
                if await asyncio.wait_for(one.recv(), PATIENCE) == "2":  # are you there?
                    await one.send("3")

    asyncio.run(visit())


def test_the_log_has_the_first_one_and_sums(monkeypatch):
    monkeypatch.setattr(gate, "_SUMMARY", 0.01)

    async def crowd():
        lines = []
        log = ConnectionLog(lines.append)
        for client in ("10.0.0.1", "10.0.0.2", "10.0.0.2"):
            log.note(client, "it was slow")
        await asyncio.sleep(0.1)
        log.note("10.0.0.3", "it was slow")
        return lines

    assert asyncio.run(crowd()) == [
        "a connection of 10.0.0.1 was ended: it was slow",
        "2 more connections were ended in 0.01 s, most of 10.0.0.2: it was slow",
        "a connection of 10.0.0.3 was ended: it was slow",
    ]
