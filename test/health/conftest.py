# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One assessed record, whose numbers the tests replace by their own."""

from dataclasses import replace

import pytest
from records import sine_record

from valve_friction_ros.identification import (
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_bench,
)
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION


@pytest.fixture(scope="session")
def tight_record():
    """The same with 1.5 times the Coulomb friction."""
    grown = 1.5 * LOW_FRICTION.coulomb_friction
    return sine_record(replace(LOW_FRICTION, coulomb_friction=grown, static_friction=grown))


@pytest.fixture(scope="session")
def result(loose_record):
    return identify_bench(loose_record, BENCH_VALVE, IdentificationSettings(assumed_mass=1.6))


@pytest.fixture(scope="session")
def friction():
    """Function of a value, its half width and its name: an assessed friction."""

    def build(value, half_width=0.0, name="coulomb_friction"):
        return Parameter(name, value, half_width / 2, half_width, Verdict.IDENTIFIED)

    return build


@pytest.fixture(scope="session")
def with_values(result):
    """Function of values or assessed parameters by name: the result with these instead."""

    def build(**changes):
        parameters = dict(result.parameters)
        for name, new in changes.items():
            is_whole = isinstance(new, Parameter)
            parameters[name] = (
                new if is_whole else Parameter(name, new, 0.0, 0.0, Verdict.IDENTIFIED)
            )
        return replace(result, parameters=parameters)

    return build


@pytest.fixture(scope="session")
def unknown():
    """Function of a name: a parameter that is not identifiable."""

    def build(name="coulomb_friction", reason="the record does not determine it"):
        nan = float("nan")
        return Parameter(name, nan, nan, nan, Verdict.NOT_IDENTIFIABLE, reason)

    return build
