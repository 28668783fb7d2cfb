"""The methods of identification by name; all take and return the same."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

from valve_friction_ros.identification.assessment import Assessment
from valve_friction_ros.identification.refined.method import SweepAssessment, assess
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.signature.force_balance import (
    ForceBalanceAssessment,
    assess_force_balance,
)
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve

__all__ = ["DEFAULT_METHOD", "METHODS", "Method", "method_named"]


class Method(Protocol):
    """A method of identification: from a record to parameters with verdicts."""

    def __call__(
        self,
        recording: Recording,
        valve: Valve,
        settings: IdentificationSettings | None = None,
        window: int | None = None,
    ) -> Assessment:
        """Identify a record; raises RefusalError for one that cannot tell."""


METHODS: Mapping[str, Method] = MappingProxyType(
    {SweepAssessment.method: assess, ForceBalanceAssessment.method: assess_force_balance}
)
"""``sweep``: the paper's model 1, refined. ``force_balance``: its model 2, from a signature."""

DEFAULT_METHOD = SweepAssessment.method


def method_named(name: str) -> Method:
    """Return the method of this name.

    Raises
    ------
    ValueError
        If there is none; the message lists them.
    """
    if name not in METHODS:
        raise ValueError(f"unknown method {name!r}; choose from {', '.join(METHODS)}")
    return METHODS[name]
