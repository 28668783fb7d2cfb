# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Copies of mappings that nobody can change: Python neither copies nor pickles those."""

import copyreg
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any


def frozen(mapping: Mapping[Any, Any]) -> MappingProxyType[Any, Any]:
    """Return a copy of a mapping that nobody can change."""
    return MappingProxyType(dict(mapping))


# Results and settings hold such mappings, and go to other processes, to joblib and to Dask.
copyreg.pickle(MappingProxyType, lambda one: (frozen, (dict(one),)))
