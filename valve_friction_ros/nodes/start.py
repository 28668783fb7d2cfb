"""Entry points of the nodes, light enough to be interrupted before a node is imported."""

import importlib
import os
import signal
import sys

__all__ = ["dashboard", "identifier", "identifiers", "pressure_source", "simulator"]


def _end(*_: object) -> None:
    os._exit(0)


def _start(node: str) -> int:
    """Import and run a node; Ctrl-C or SIGTERM while it is still being imported ends it at once."""
    # An exception in the midst of an import may be lost there.
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, _end)
    module = importlib.import_module(f"valve_friction_ros.nodes.{node}")
    if {"-h", "--help"} & set(sys.argv[1:]):
        # Whoever stops reading, as `head` does, ends it without a word.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        words = importlib.import_module("valve_friction_ros.nodes.plumbing.help_text")
        print(words.help_text(node.split(".", maxsplit=1)[0], module.__doc__, module.PARAMETERS))  # noqa: T201
        return 0
    exit_code: int = module.main()
    # All is closed: Python would take a second more to take its modules apart.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(exit_code)


def dashboard() -> int:
    """Run the node `dashboard`, which computes nothing that is compiled."""
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # numba takes 110 MB
    return _start("dashboard.node")


def identifier() -> int:
    """Run the node `identifier`."""
    return _start("identifier.node")


def identifiers() -> int:
    """Run the node `identifiers`."""
    return _start("identifiers")


def simulator() -> int:
    """Run the node `simulator`."""
    return _start("simulator")


def pressure_source() -> int:
    """Run the node `pressure_source`."""
    return _start("pressure_source")
