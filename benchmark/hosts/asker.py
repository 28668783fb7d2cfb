# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Asks some valves of its host to identify, one after the other, and prints how many answered."""

import sys
from collections.abc import Sequence

from valve_friction_ros.nodes.service_call import caller

__all__ = ["main"]

_PATIENCE = 300.0


def main(valves: Sequence[str] | None = None) -> int:
    """Ask the valves of the arguments; refusals are answers."""
    answered = 0
    with caller(lambda: True) as client:
        for valve in sys.argv[1:] if valves is None else valves:
            identifier = client.find(valve, _PATIENCE)
            answered += client.call(identifier, "identify", _PATIENCE) is not None
    print(answered, flush=True)  # noqa: T201
    return 0


if __name__ == "__main__":
    sys.exit(main())
