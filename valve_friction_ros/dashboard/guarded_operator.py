"""Calls of services by those alone who may operate."""

from collections.abc import Callable

from valve_friction_ros.dashboard.graph import Answer, Operator, Visitors
from valve_friction_ros.outside_text import printable

__all__ = ["GuardedOperator"]


class GuardedOperator:
    """Calls services for a visitor who may operate at the moment of the call.

    Parameters
    ----------
    operator : Operator
        Calls the services.
    visitors : Visitors
        Who asks.
    log : callable
        Takes a line for each call of somebody with an account.
    """

    def __init__(self, operator: Operator, visitors: Visitors, log: Callable[[str], None]) -> None:
        self._operator, self._visitors, self._log = operator, visitors, log

    async def call(self, node: str, service: str) -> Answer:
        """Call a service of an identifier; refused to others, to whom the answer says so."""
        if not self._visitors.may_operate():
            return Answer(False, "your account may not operate: log in with one that may")
        if name := self._visitors.name():
            self._log(f"{name} calls {printable(node)}/{printable(service)}")
        return await self._operator.call(node, service)
