"""A ROS domain of this machine that nobody else uses."""

import contextlib
import os
from collections.abc import Iterator

from valve_friction_ros.commands.demo.bench_processes import free_domain

__all__ = ["quiet_domain"]


@contextlib.contextmanager
def quiet_domain() -> Iterator[int]:
    """Provide a domain of this machine that nobody else uses."""
    with free_domain() as domain:
        os.environ |= {
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "RCUTILS_COLORIZED_OUTPUT": "0",
        }
        yield domain
