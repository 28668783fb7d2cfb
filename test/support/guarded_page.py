# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A page with one button behind the gate, as a process: `python guarded_page.py PORT [OPTIONS]`."""

import argparse
import contextlib
import sys
from pathlib import Path

from nicegui import app, ui

from valve_friction_ros.dashboard.accounts import Access, accounts_from
from valve_friction_ros.dashboard.gate import guard, server_options

operations = []


def say(line):
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("--host", default="127.0.0.1")
    for name in ("certificate", "key", "session_file"):
        parser.add_argument(f"--{name}", type=Path)
    options = parser.parse_args()
    access = Access(
        options.host,
        accounts=accounts_from(None),
        certificate=options.certificate,
        key=options.key,
        session_file=options.session_file,
    )
    guarding = guard(app, access, say)

    @ui.page("/")
    def page():
        visitor = guarding.visitor()
        ui.label(f"Hello {visitor.name if visitor else 'nobody'}")

        def operate():
            if guarding.may_operate():
                operations.append(1)
            said.set_text(f"operations: {len(operations)}")

        ui.button("Operate", on_click=operate)
        ui.button("Log out", on_click=guarding.log_out)
        said = ui.label("operations: -")

    @app.get("/operations")
    def count():
        return len(operations)

    ui.run(
        port=options.port,
        show=False,
        reload=False,
        tailwind=False,
        show_welcome_message=False,
        timeout_graceful_shutdown=1,
        **server_options(access, say),
    )


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
