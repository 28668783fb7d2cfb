"""The names that valve files and nodes share are those of the nodes."""

from dataclasses import fields

import pytest

from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.records.valve_keys import NODE_NAMES, SETTINGS, is_known

parameters = pytest.importorskip("valve_friction_ros.nodes.identifier.parameters")


def test_every_parameter_of_a_node_is_known():
    from valve_friction_ros.nodes import identifiers, pressure_source, simulator
    from valve_friction_ros.nodes.dashboard import parameters as dashboard

    modules = (parameters, identifiers, pressure_source, simulator, dashboard)
    names = {spec.name for module in modules for spec in module.PARAMETERS}
    assert names <= NODE_NAMES
    assert names | {"limit_velocity"} >= NODE_NAMES


def test_the_settings_are_those_of_an_identification():
    known = {field.name for field in fields(IdentificationSettings)} - {"steps", "resolution"}
    known -= {"stated"}  # the nominal parameters of the file, by their own names
    named = {name.partition(".")[0] for name in SETTINGS} - {"method"}
    assert named == {"polynomial_order" if name == "order" else name for name in known}


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("use_sim_time", True),
        ("qos_overrides./a.subscription.depth", True),
        ("columns.time_column", True),
        ("diaphragm_aera", False),
        ("fixed.mas", False),
    ],
)
def test_known(name, known):
    assert is_known(name) == known
