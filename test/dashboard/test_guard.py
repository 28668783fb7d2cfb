# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The gate before a running NiceGUI page, by real connections, HTTP requests and a browser."""

import asyncio
import contextlib
import json
import os
import re
import resource
import signal
import socket
import ssl
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import pytest
from browser import axe_violations, chromium
from local_server import certificate_pair, free_port
from processes import PATIENCE, wait_until
from quick_accounts import PASSWORD, quick_account

from valve_friction_ros.dashboard.accounts import VARIABLE, Access, Role
from valve_friction_ros.dashboard.log_in import Sessions

pytest.importorskip("httpx", reason="run `make venv-dashboard`")
pytest.importorskip("nicegui", reason="run `make venv-dashboard`")

import httpx
import websockets
from starlette.responses import PlainTextResponse

from valve_friction_ros.dashboard.gate import ARRIVAL_TIME, MOST_OF_A_CLIENT, Gate
from valve_friction_ros.dashboard.pages.server import LightlyPacked

URL = "http://127.0.0.1:8080"
SCRIPT = Path(__file__).parents[1] / "support" / "guarded_page.py"
ACCOUNTS = f"{quick_account('anna')};{quick_account('bo', Role.VIEW)}"
POLLING = "/_nicegui_ws/socket.io/?EIO=4&transport=polling"


class Served(NamedTuple):
    """A running page."""

    port: int
    process: subprocess.Popen
    output: Path

    @property
    def url(self):
        return f"http://127.0.0.1:{self.port}"

    def opens(self):
        with contextlib.suppress(httpx.HTTPError):
            return "Operate" in httpx.get(self.url, timeout=5.0).text
        return False

    def connect(self, source, sent):
        made = socket.create_connection(("127.0.0.1", self.port), PATIENCE, (source, 0))
        made.sendall(sent)
        return made

    def open_files(self):
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))


@contextlib.contextmanager
def served(folder, *arguments, accounts=""):
    """Run the page, and see that Ctrl-C ends it."""
    port = free_port()
    # NiceGUI takes a process that pytest has started for a test of its own kind.
    hidden = {name: text for name, text in os.environ.items() if not name.startswith("PYTEST")}
    output = folder / "output.txt"
    with output.open("w") as stream:
        process = subprocess.Popen(
            [sys.executable, SCRIPT, str(port), *map(str, arguments)],
            cwd=folder,
            env=hidden | {VARIABLE: accounts},
            stdout=stream,
            stderr=subprocess.STDOUT,
        )
    try:

        def is_open():
            assert process.poll() is None, output.read_text()
            with socket.socket() as tried:
                return tried.connect_ex(("127.0.0.1", port)) == 0

        wait_until(is_open, output.read_text)
        yield Served(port, process, output)
        process.send_signal(signal.SIGINT)
        process.wait(timeout=PATIENCE)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    assert "Traceback" not in output.read_text(), output.read_text()


@pytest.fixture
def browser():
    """Not longer than its test: asyncio cannot run beside it."""
    with chromium() as one:
        yield one


@pytest.fixture(scope="module")
def private(tmp_path_factory):
    """A page with accounts."""
    with served(tmp_path_factory.mktemp("private"), accounts=ACCOUNTS) as page:
        yield page.url


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """A page of this machine, without accounts."""
    with served(tmp_path_factory.mktemp("local")) as page:
        yield page.url


def visitor(url, **headers):
    return httpx.Client(base_url=url, headers={"Accept": "text/html", **headers}, timeout=PATIENCE)


def logged_in(url, name="anna", password=PASSWORD):
    client = visitor(url)
    answer = client.post("/login", data={"name": name, "password": password, "next": "/"})
    assert answer.status_code == 303, answer.text
    return client


def operations(url):
    with closing(logged_in(url)) as client:
        return client.get("/operations").json()


def test_refused_log_ins_are_logged_within_a_bound():
    account, lines = quick_account(), []
    gate = Gate(
        None, Access(accounts=(account,)), Sessions([account], 60.0, lambda: 0.0), lines.append
    )

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


class TestWithoutSession:
    def test_a_page_leads_to_the_log_in_and_back(self, private):
        answer = visitor(private).get("/valve?node=/fv_101&zone=UTC")
        assert answer.status_code == 303
        assert answer.headers["location"] == "/login?next=%2Fvalve%3Fnode%3D%2Ffv_101%26zone%3DUTC"
        form = visitor(private).get(answer.headers["location"])
        assert form.status_code == 200
        assert 'value="/valve?node=/fv_101&amp;zone=UTC"' in form.text
        assert "<script" not in form.text

    @pytest.mark.parametrize(
        "path",
        [
            "/operations",
            "/_nicegui/3.18.0/static/nicegui.js",
            POLLING,
            "/login/state",
            "/openapi.json",
            "/docs",
            "//operations",
            "/login/../operations",
        ],
    )
    def test_nothing_else_is_served(self, private, path):
        for method in ("GET", "POST", "HEAD", "PUT", "DELETE", "OPTIONS"):
            answer = httpx.request(method, private + path, headers={"Accept": "*/*"})
            assert answer.status_code == 401
            assert answer.headers["cache-control"] == "no-store"

    def test_what_is_asked_back_to_is_no_markup_and_no_other_host(self, private):
        form = visitor(private).get("/login", params={"next": '/"><script>alert(1)</script>'})
        assert "<script" not in form.text
        for there in ("//evil.example", "https://evil.example/", "/\\evil.example"):
            form = visitor(private).get("/login", params={"next": there})
            assert 'name="next" value="/"' in form.text
            answer = visitor(private).post(
                "/login", data={"name": "anna", "password": PASSWORD, "next": there}
            )
            assert answer.headers["location"] == "/"


class TestLogIn:
    def test_the_cookie(self, private):
        answer = visitor(private).post("/login", data={"name": "anna", "password": PASSWORD})
        cookie = answer.headers["set-cookie"]
        port = private.rpartition(":")[2]
        assert re.match(rf"valve_friction_{port}=[\w-]{{43}}; ", cookie)
        for word in ("HttpOnly", "Path=/", "SameSite=lax", "Max-Age=43200"):
            assert word in cookie
        assert "Secure" not in cookie

    def test_wrong_answers_do_not_tell_which_names_there_are(self, private):
        answers = [
            visitor(private).post("/login", data={"name": name, "password": "wrong"})
            for name in ("anna", "nobody")
        ]
        assert [each.status_code for each in answers] == [401, 401]
        assert answers[0].text == answers[1].text
        assert "set-cookie" not in answers[0].headers

    def test_forms_that_are_none(self, private):
        for body in (b"x" * 5000, b"\xff=\xff", b"&".join(b"a=1" for _ in range(50))):
            assert visitor(private).post("/login", content=body).status_code == 400

    def test_a_new_log_in_ends_the_session_before(self, private):
        with closing(logged_in(private)) as client:
            (old,) = client.cookies.items()
            assert client.get("/login/state").status_code == 204
            client.post("/login", data={"name": "bo", "password": PASSWORD})
            assert "Hello bo" in client.get("/").text
            with visitor(private) as other:
                other.cookies.set(*old)
                assert other.get("/").status_code == 303


class TestForeign:
    @pytest.mark.parametrize("host", ["evil.example", "evil.example:8080", "10.0.0.1", ""])
    def test_names_are_refused(self, local, private, host):
        for url in (local, private):
            answer = visitor(url, Host=host).get("/")
            assert answer.status_code == 400
            assert "NiceGUI" not in answer.text

    @pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1"])
    def test_origins_are_refused(self, local, private, origin):
        for url in (local, private):
            client = logged_in(url) if url == private else visitor(url)
            with closing(client):
                form = {"name": "anna", "password": PASSWORD}
                for method, path in (("GET", "/"), ("POST", "/login"), ("GET", POLLING)):
                    answer = client.request(method, path, data=form, headers={"Origin": origin})
                    assert answer.status_code == 403
                    assert "access-control-allow-origin" not in answer.headers

    def test_own_origin_and_names_are_taken(self, local):
        port = local.rpartition(":")[2]
        for host in (f"127.0.0.1:{port}", f"localhost:{port}"):
            answer = visitor(local, Host=host, Origin=f"http://{host}").get("/")
            assert answer.status_code == 200
            assert "Hello nobody" in answer.text


@pytest.mark.parametrize("path", ["/", "/operations", "/not-there"])
def test_headers(local, path):
    headers = visitor(local).get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "same-origin"
    assert "server" not in headers
    policy = dict(part.strip().partition(" ")[::2] for part in
                  headers["content-security-policy"].split(";"))  # fmt: skip
    assert policy["frame-ancestors"] == policy["object-src"] == policy["base-uri"] == "'none'"
    assert policy["default-src"] == policy["connect-src"] == policy["form-action"] == "'self'"


def found_in(page):
    """Client, and the listeners of the buttons, as NiceGUI's page names them."""
    client_id = re.search(r"'client_id': '([\w-]+)'|\"client_id\": ?\"([\w-]+)\"", page)
    elements = json.loads(
        re.search(r"parseElements\(String\.raw`(.*?)`\)", page, re.DOTALL)[1]
        .replace("&#36;", "$").replace("&#96;", "`").replace("&lt;", "<").replace("&gt;", ">")
        .replace("&amp;", "&")
    )  # fmt: skip
    buttons = {
        element["props"]["label"]: (int(number), element["events"][0]["listener_id"])
        for number, element in elements.items()
        if element.get("props", {}).get("label")
    }
    return (client_id[1] or client_id[2]), buttons


class Socket:
    """A NiceGUI page's own connection, within `async with`."""

    def __init__(self, url, page, cookies=None, origin=None, transport="websocket"):
        self.client_id, self.buttons = found_in(page)
        self.url, self.transport, self.headers = url, transport, {}
        if cookies is not None:
            self.headers["Cookie"] = "; ".join(f"{k}={v}" for k, v in cookies.items())
        if origin is not None:
            self.headers["Origin"] = origin
        self.changes, self.ended = [], asyncio.Event()

    async def __aenter__(self):
        import aiohttp
        import socketio

        self.http = aiohttp.ClientSession(headers=self.headers)
        self.io = socketio.AsyncClient(reconnection=False, http_session=self.http)
        self.io.on("update", lambda change: self.changes.append(json.dumps(change)))
        self.io.on("disconnect", lambda *_: self.ended.set())
        query = (
            f"client_id={self.client_id}&tab_id=t-{self.client_id}&document_id=d"
            "&implicit_handshake=true&next_message_id=0"
        )
        try:
            await self.io.connect(
                f"{self.url}?{query}",
                headers=self.headers,
                socketio_path="/_nicegui_ws/socket.io",
                transports=[self.transport],
                wait_timeout=PATIENCE,
            )
        except socketio.exceptions.ConnectionError:
            await self.http.close()
            raise
        return self

    async def __aexit__(self, *_):
        await self.io.disconnect()
        await self.http.close()

    async def press(self, label):
        number, listener = self.buttons[label]
        message = {"id": number, "client_id": self.client_id, "listener_id": listener, "args": []}
        await self.io.emit("event", message)


async def eventually(condition):
    deadline = time.monotonic() + PATIENCE
    while not await asyncio.to_thread(condition):
        assert time.monotonic() < deadline
        await asyncio.sleep(0.05)


async def refused(strange):
    import socketio

    with pytest.raises(socketio.exceptions.ConnectionError):
        async with strange:
            pass


@pytest.mark.parametrize("transport", ["websocket", "polling"])
class TestWebSocket:
    def test_none_without_a_session(self, private, transport):
        with closing(logged_in(private)) as client:
            page = client.get("/").text
        for cookies in (None, {"valve_friction": "x"}):
            asyncio.run(refused(Socket(private, page, cookies, transport=transport)))

    @pytest.mark.slow
    def test_none_from_a_foreign_page(self, local, private, transport):
        async def visit(url, client):
            with closing(client):
                page = client.get("/").text
                for origin in ("http://evil.example", "null"):
                    await refused(Socket(url, page, client.cookies, origin, transport))
                async with Socket(url, page, client.cookies, url, transport) as own:
                    assert not own.ended.is_set()

        asyncio.run(visit(local, visitor(local)))
        asyncio.run(visit(private, logged_in(private)))

    @pytest.mark.slow
    def test_who_may_view_may_not_operate(self, private, transport):
        before = operations(private)

        async def visit(name, expected):
            with closing(logged_in(private, name)) as client:
                page = client.get("/").text
                async with Socket(private, page, client.cookies, transport=transport) as opened:
                    await opened.press("Operate")
                    await eventually(lambda: f"operations: {expected}" in " ".join(opened.changes))

        asyncio.run(visit("bo", before))
        assert operations(private) == before
        asyncio.run(visit("anna", before + 1))
        assert operations(private) == before + 1

    def test_log_out_ends_the_session_and_closes_its_connections(self, private, transport):
        before = operations(private)

        async def visit():
            with closing(logged_in(private)) as client:
                one, other = (
                    Socket(private, client.get("/").text, client.cookies, transport=transport)
                    for _ in range(2)
                )
                async with one, other:
                    await one.press("Log out")
                    await eventually(lambda: client.get("/login/state").status_code == 401)
                    await other.press("Operate")
                    await asyncio.wait_for(other.ended.wait(), PATIENCE)
                assert client.get("/").status_code == 303

        asyncio.run(visit())
        assert operations(private) == before


@pytest.fixture(scope="module")
def encrypted(tmp_path_factory):
    """A client of a page with a certificate, and the page's folder."""
    folder = tmp_path_factory.mktemp("encrypted")
    certificate, key = certificate_pair(folder)
    words = ("--certificate", certificate, "--key", key, "--session_file", folder / "sessions")
    with served(folder, *words, accounts=ACCOUNTS) as page:
        trusted = ssl.create_default_context(cafile=certificate)
        url = f"https://localhost:{page.port}"
        with httpx.Client(base_url=url, verify=trusted, timeout=PATIENCE) as client:
            yield client, folder


def test_tls(encrypted):
    client, folder = encrypted
    answer = client.post("/login", data={"name": "anna", "password": PASSWORD})
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith(f"__Host-valve_friction_{client.base_url.port}=")
    assert "Secure" in cookie
    assert "Hello anna" in client.get("/").text
    for path in ("/", "/login"):
        assert client.get(path).headers["strict-transport-security"] == "max-age=86400"
    with pytest.raises(httpx.RemoteProtocolError):
        httpx.get(f"http://localhost:{client.base_url.port}/")
    kept = folder / "sessions"
    assert kept.stat().st_mode & 0o777 == 0o600
    assert len(json.loads(kept.read_text())) == 1


def test_tries_are_bounded(encrypted):
    """After ten, neither the right password nor a made-up address helps."""
    client, _ = encrypted
    form = {"name": "anna", "password": "wrong"}
    codes = [client.post("/login", data=form).status_code for _ in range(10)]
    assert codes == [401] * 10
    for headers in ({}, {"X-Forwarded-For": "10.9.9.9"}, {"Forwarded": "for=10.9.9.9"}):
        answer = client.post("/login", data=form | {"password": PASSWORD}, headers=headers)
        assert answer.status_code == 429
        assert 700 < int(answer.headers["retry-after"]) <= 900
        assert re.search("try again in 1[45] min", answer.text)


def test_log_in_and_out_in_a_browser(private, browser):
    """The browser's own rules are kept: no violation of the policy, no request to another host."""
    page = browser.new_page(viewport={"width": 390, "height": 900})
    page.set_default_timeout(PATIENCE * 1000)
    said, asked = [], []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(f"{private}/?zone=UTC")
    assert page.url.startswith(f"{private}/login")
    page.get_by_label("Name").fill("anna")
    assert axe_violations(page) == []
    page.get_by_label("Password").fill("not " + PASSWORD)
    page.keyboard.press("Enter")
    page.get_by_role("alert").wait_for()
    page.get_by_label("Name").fill("anna")
    page.get_by_label("Password").fill(PASSWORD)
    page.keyboard.press("Enter")
    page.get_by_text("Hello anna").wait_for()
    assert page.url == f"{private}/?zone=UTC"
    before = operations(private)
    page.get_by_role("button", name="Operate").click()
    page.get_by_text(f"operations: {before + 1}").wait_for()
    page.get_by_role("button", name="Log out").click()
    page.get_by_label("Password").wait_for()
    page.goto(private)
    assert page.url.startswith(f"{private}/login")
    assert all(url.startswith((private, private.replace("http", "ws"), "data:")) for url in asked)
    assert not [line for line in said if "Content Security Policy" in line], said
    assert not [line for line in said if "Error" in line and "401" not in line], said


# Connections that send no request, or only half of one

FILES = 1024
"""Files that the server may open: the usual limit of a shell."""
HALF = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.fixture
def page(tmp_path):
    """A page in a process of few files."""
    with served(tmp_path) as made:
        resource.prlimit(made.process.pid, resource.RLIMIT_NOFILE, (FILES, FILES))
        assert made.opens()
        yield made


@pytest.fixture
def opened():
    with contextlib.ExitStack() as stack:
        yield stack.enter_context


@pytest.mark.slow
@pytest.mark.parametrize("source", ["127.0.0.2", "127.0.0.1"])
def test_1100_half_requests_do_not_take_the_pages(page, opened, source):
    """Neither from another client, nor from the client's own address."""
    before = page.open_files()
    for _ in range(1100):
        opened(page.connect(source, HALF))
    assert page.opens()
    assert page.open_files() <= before + MOST_OF_A_CLIENT + 1
    wait_until(lambda: page.open_files() <= before + 2, patience=ARRIVAL_TIME + 10.0)
    assert page.opens()
    lines = [line for line in page.output.read_text().splitlines() if source in line]
    assert 1 <= len(lines) <= 60
    assert set(lines) == {f"a connection of {source} was closed: more than 256 were open"}


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


@pytest.mark.slow
@pytest.mark.parametrize(("sent", "slowly"), [(b"", b""), (HALF, b""), (HALF, b"X-Slow: 1\r\n")])
def test_half_a_request_ends_after_ten_seconds(page, opened, sent, slowly):
    """Without a byte, as browsers do, which is not logged; within the headers, slow ones too."""
    made = opened(page.connect("127.0.0.2", sent))
    assert 0.9 * ARRIVAL_TIME < time_until_the_end(made, slowly) < 2 * ARRIVAL_TIME
    told = "a connection of 127.0.0.2 was closed: its request did not arrive within 10 s"
    assert (told in page.output.read_text()) is bool(sent)


@pytest.mark.slow
def test_pages_that_are_open_live_on(page, opened):
    """A WebSocket outlives the time for requests, and a crowd of its own address."""
    address = page.url.replace("http", "ws") + POLLING.replace("polling", "websocket")

    async def visit():
        async with websockets.connect(address, origin=page.url, ping_interval=None) as one:
            assert (await one.recv()).startswith("0{")
            begun = time.monotonic()
            for _ in range(400):
                opened(page.connect("127.0.0.1", HALF))
            await one.send("40")
            while time.monotonic() < begun + ARRIVAL_TIME + 5.0:
                if await asyncio.wait_for(one.recv(), PATIENCE) == "2":  # are you there?
                    await one.send("3")

    asyncio.run(visit())
