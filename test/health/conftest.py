"""One assessed record, whose numbers the tests replace by their own."""

from dataclasses import replace

import pytest
from records import sine_record

from valve_friction_ros.identification import (
    AssessedParameter,
    IdentificationSettings,
    Verdict,
    assess,
)
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION


@pytest.fixture(scope="session")
def tight_record():
    """The same with 1.5 times the Coulomb friction."""
    grown = 1.5 * LOW_FRICTION.coulomb_friction
    return sine_record(replace(LOW_FRICTION, coulomb_friction=grown, static_friction=grown))


@pytest.fixture(scope="session")
def assessment(loose_record):
    return assess(loose_record, BENCH_VALVE, IdentificationSettings(assumed_mass=1.6))


@pytest.fixture(scope="session")
def friction():
    """Function of a value and its half width: an assessed Coulomb friction."""

    def build(value, half_width=0.0):
        return AssessedParameter(
            "coulomb_friction", value, half_width / 2, half_width, Verdict.IDENTIFIED
        )

    return build


@pytest.fixture(scope="session")
def with_values(assessment):
    """Function of values or assessed parameters by name: the assessment with these instead."""

    def build(**changes):
        parameters = dict(assessment.parameters)
        for name, new in changes.items():
            is_whole = isinstance(new, AssessedParameter)
            parameters[name] = (
                new if is_whole else AssessedParameter(name, new, 0.0, 0.0, Verdict.IDENTIFIED)
            )
        return replace(assessment, parameters=parameters)

    return build


@pytest.fixture(scope="session")
def unknown():
    """Function of a name: a parameter that is not identifiable."""

    def build(name="coulomb_friction", reason="the record does not tell it"):
        nan = float("nan")
        return AssessedParameter(name, nan, nan, nan, Verdict.NOT_IDENTIFIABLE, reason)

    return build
