# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Entry point of the command `valve_friction`, which can be interrupted at once."""

import importlib
import os
import signal
import sys
from types import FrameType

_INTERRUPTED = 128 + signal.SIGINT


def end_at_once(*_: int | FrameType | None) -> None:
    """End the process with one line: there is nothing to clean up yet."""
    words = " ".join(["valve_friction", *sys.argv[1:2]])
    try:
        os.write(2, f"{words}: interrupted\n".encode())
    finally:
        os._exit(_INTERRUPTED)


def main() -> int:
    """Run the command; Ctrl-C during the import ends the process at once."""
    # An exception raised during an import may be swallowed there.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, end_at_once)
    # For such small matrices a second thread costs more than it gains.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    code: int = importlib.import_module("valve_friction_ros.commands.main").main()
    return code
