# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Requests to the services of other nodes, of which none is lost; whoever asks turns the executor.

A node that has not met a new client yet answers it in vain, however ready its service is: DDS tells
both sides at their own pace, on a loaded machine a second late. So a request that does no harm
twice is made again until it is answered. One that does is made once, after another client of the
same program has had an answer from the same node: a node meets the clients of a program in the
order in which they were made.
"""

import time
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

_AGAIN = 0.5
"""Time without an answer, s, after which a harmless request is made again."""
_NO_PARAMETERS = 2.0
"""Time, s, for which the parameters of a node are looked for. Chosen: they are there by default."""


class UnansweredError(Exception):
    """There will be no answer; the message says of which service, and why."""


class LateError(UnansweredError):
    """There was no answer in time."""


class PatientRequest:
    """A request that does no harm twice: it is made again until it is answered.

    Parameters
    ----------
    node : Node
        Who asks; its executor is turned between two steps.
    kind : type
        Type of the service.
    name : str
        Name of the service.
    request : message
        What is asked.

    Attributes
    ----------
    answer : message or None
        The answer, once there is one.
    """

    def __init__(self, node: Node, kind: type, name: str, request: Any) -> None:
        self.answer: Any = None
        self._node, self._request = node, request
        self._client: Any = node.create_client(kind, name)
        self._pending: list[Any] = []
        self._again = 0.0

    def is_met(self) -> bool:
        """Return whether the service is there."""
        return bool(self._client.service_is_ready())

    def step(self) -> bool:
        """Go on; return whether there is an answer."""
        done = next((one for one in self._pending if one.done()), None)
        if done is not None:
            self.answer = done.result()
        elif self.is_met() and time.monotonic() > self._again:
            self._again = time.monotonic() + _AGAIN
            self._pending.append(self._client.call_async(self._request))
        return self.answer is not None

    def close(self) -> None:
        """Forget it."""
        self._node.destroy_client(self._client)


def set_parameters_request(node: Node, target: str, values: Mapping[str, Any]) -> PatientRequest:
    """Return the request that sets parameters of the node `target`, all at once."""
    request = SetParametersAtomically.Request(
        parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]
    )
    name = f"{target}/set_parameters_atomically"
    return PatientRequest(node, SetParametersAtomically, name, request)


class TriggerCall:
    """One call of a std_srvs/Trigger service, or of a SetBool one, which is made once.

    Parameters
    ----------
    node : Node
        Who calls; its executor is turned between two steps.
    identifier : str
        Fully qualified name of the node that is called.
    service : str
        Name of its service, without the node.
    meeting : float
        Longest time until the service is met, s.
    patience : float
        Longest time until the answer, s.
    values : mapping of str to object, optional
        Parameters of the node that are set before, all at once; they hold for this call.
    switch : bool, optional
        What a SetBool service is given; None: the service takes nothing.

    Attributes
    ----------
    answer : Trigger.Response or None
        The answer, once there is one.
    """

    def __init__(
        self,
        node: Node,
        identifier: str,
        service: str,
        meeting: float,
        patience: float,
        values: Mapping[str, Any] | None = None,
        switch: bool | None = None,
    ) -> None:
        self.answer: Any = None
        self._values, self._switch = values, switch
        self._node, self._identifier = node, identifier
        self._name = f"{identifier}/{service}"
        self._meeting, self._patience = meeting, patience
        self._begun = time.monotonic()
        self._client: Any = None
        self._greeting: PatientRequest | None = None
        self._future: Any = None

    @property
    def is_made(self) -> bool:
        """Whether the service has been called."""
        return self._future is not None

    def step(self) -> bool:
        """Go on; return whether there is an answer.

        Raises UnansweredError if there will be none.
        """
        if self._client is None:
            self._begin()
        waited = time.monotonic() - self._begun
        is_there = self._client.service_is_ready()
        if self._future is None:
            if is_there and self._is_known(waited):
                request = Trigger.Request()
                if self._switch is not None:
                    request = SetBool.Request(data=self._switch)
                self._future = self._client.call_async(request)
            elif not is_there and waited > self._meeting:
                raise UnansweredError(
                    f"{self._name} is not there: start the identifier of this valve"
                )
        elif self._future.done():
            self.answer = self._future.result()
            return True
        elif not is_there:
            raise UnansweredError(f"{self._identifier} has ended before it answered")
        if waited > self._patience:
            raise LateError(
                f"{self._name} has not answered within {self._patience:g} s: it goes on"
            )
        return False

    def _begin(self) -> None:
        """Make the client, and after it the one whose answer shows that both are known."""
        try:
            kind = Trigger if self._switch is None else SetBool
            self._client = self._node.create_client(kind, self._name)
        except Exception as error:  # noqa: BLE001 - rclpy's, where the name is no name of a service
            about = str(error).partition("\n")[0]
            raise UnansweredError(f"{self._name} cannot be called: {about}") from None
        if self._values:
            self._greeting = set_parameters_request(self._node, self._identifier, self._values)
            return
        self._greeting = PatientRequest(
            self._node,
            GetParameters,
            f"{self._identifier}/get_parameters",
            GetParameters.Request(),
        )

    def _is_known(self, waited: float) -> bool:
        """Return whether the node has met this client; True where it has no parameters to ask."""
        greeting = self._greeting
        if greeting is None:
            return True
        if greeting.step():
            if self._values and not greeting.answer.result.successful:
                raise UnansweredError(greeting.answer.result.reason)
            return True
        return not self._values and not greeting.is_met() and waited > _NO_PARAMETERS

    def close(self) -> None:
        """Forget it; a call that was made goes on."""
        if self._client is not None:
            self._node.destroy_client(self._client)
        if self._greeting is not None:
            self._greeting.close()
