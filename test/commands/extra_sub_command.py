# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command with one sub-command more, ``extra``: what a further one takes, and how all end.

The sub-command is this module, one line of `SUB_COMMANDS` and a declaration of its arguments.
"""

import io
import os
import signal
import sys
import time

from valve_friction_ros.commands import main
from valve_friction_ros.commands.arguments import declared
from valve_friction_ros.identification import RefusalError


class Interrupting:
    """Python ignores what its end raises, as it does in callbacks of an import."""

    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)


class InterruptingFile(io.RawIOBase):
    def readable(self):
        return True

    def readinto(self, _):
        os.kill(os.getpid(), signal.SIGINT)
        return 0


def declare(parser):
    parser.description = "One sub-command more."
    parser.add_argument("ending")


def interrupt(ending):
    if ending == "interrupted":
        os.kill(os.getpid(), signal.SIGINT)
    if ending == "disguised":  # as numpy does while it is imported
        try:
            os.kill(os.getpid(), signal.SIGINT)
        except KeyboardInterrupt as interrupt:
            raise ImportError("numpy cannot be imported") from interrupt
    if ending == "in a parser":
        import pandas as pd

        pd.read_csv(InterruptingFile())
    if ending == "ignored":
        Interrupting()
        time.sleep(30)
    if ending == "swallowed":
        import swallowing_module  # noqa: F401


def run(options):
    interrupt(options.ending)
    if options.ending == "own refusal":
        raise RefusalError("not this\none")
    if options.ending == "refusal":
        raise ValueError("not that one")
    if options.ending == "no file":
        raise FileNotFoundError(2, "No such file or directory", "none.csv")
    if options.ending == "bug":
        raise KeyError("a bug")
    sys.stdout.write("x" * 100_000 if options.ending == "long" else "short\n")
    return 1


if __name__ == "__main__":
    main.SUB_COMMANDS["extra"] = "one sub-command more"
    declared.DECLARATIONS = {**declared.DECLARATIONS, "extra": declare}
    sys.modules["valve_friction_ros.commands.extra"] = sys.modules["__main__"]
    sys.exit(main.main())
