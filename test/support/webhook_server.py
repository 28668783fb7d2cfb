# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A webhook's receiver, over http or https, that can misbehave."""

import contextlib
import http.server
import json
import ssl
import threading

from local_server import certificate_pair


class _Handler(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.requests.append((self.path, dict(self.headers), body))
        self.server.answer(self)

    def log_message(self, *_):
        pass


class _Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def handle_error(self, *_):
        pass  # clients hang up


def answer_with(status, **headers):
    def answer(handler):
        handler.send_response(status)
        for name, value in headers.items():
            handler.send_header(name, value)
        handler.send_header("Content-Length", "0")
        handler.end_headers()

    return answer


def answer_never(handler):
    handler.server.released.wait(60.0)


def answer_slowly(handler):
    """Send a byte of a header now and then, each well within any time-out of a socket."""
    with contextlib.suppress(OSError):
        handler.wfile.write(b"HTTP/1.0 200 OK\r\nX-Long: ")
        while not handler.server.released.wait(0.05):
            handler.wfile.write(b"x")


def answer_for_ever(handler, start=b"HTTP/1.0 200 OK\r\n\r\n"):
    with contextlib.suppress(OSError):
        handler.wfile.write(start)
        while not handler.server.released.is_set():
            handler.wfile.write(b"x" * 65536)


def headers_for_ever(handler):
    answer_for_ever(handler, b"HTTP/1.0 200 OK\r\nX-Long: ")


def no_http(handler):
    with contextlib.suppress(OSError):
        handler.wfile.write(b"SSH-2.0-nothing\r\n\r\n")


class Receiver:
    """A receiver on this machine; `answer` may be changed while it runs."""

    def __init__(self, certificate=None, port=0, answer=None):
        self._server = _Server(("127.0.0.1", port), _Handler)
        self._server.requests = []
        self._server.released = threading.Event()
        self.answer = answer or answer_with(204)
        scheme = "http"
        if certificate is not None:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(certificate)
            self._server.socket = context.wrap_socket(self._server.socket, server_side=True)
            scheme = "https"
        self.port = self._server.server_address[1]
        host = "127.0.0.1" if certificate is None else "localhost"
        self.url = f"{scheme}://{host}:{self.port}/hook?valve=1"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.02,))
        self._thread.start()

    @property
    def answer(self):
        return self._server.answer

    @answer.setter
    def answer(self, answer):
        self._server.answer = answer

    @property
    def requests(self):
        """Path, headers and body of each request."""
        return self._server.requests

    @property
    def bodies(self):
        return [json.loads(body) for _, _, body in self.requests]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.released.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


def self_signed(folder):
    """Make a certificate of `localhost` with its key, in one file."""
    certificate, key = certificate_pair(folder)
    path = folder / "localhost.pem"
    path.write_bytes(key.read_bytes() + certificate.read_bytes())
    return path
