# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Refusal of a record that does not determine the friction."""


class RefusalError(Exception):
    """A record does not determine what was asked for; the message names cause and remedy.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445)
    >>> try:
    ...     vf.identify(vf.Recording(0.01, [1e5] * 1000, [0.01] * 1000), valve)
    ... except vf.RefusalError as refusal:
    ...     print(str(refusal).split(":")[0])
    the stem did not move
    """


class LittleMotionError(RefusalError):
    """A record is too short, or its valve moves too little: no fault, since valves mostly rest."""
