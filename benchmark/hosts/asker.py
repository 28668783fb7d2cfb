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
