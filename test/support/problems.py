"""Problems of the refinement with a known solution."""

from valve_friction_ros.identification.refined.output_error import SLIP, START, OutputError
from valve_friction_ros.identification.units import CLOCK_OFFSET
from valve_friction_ros.signals.conditioned_record import ConditionedRecord

FREE = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload", START)


def true_coordinates(parameters, start=0.0):
    """The coordinates of a model, and of the position it starts from."""
    values = dict(vars(parameters))
    values[SLIP] = values.pop("static_friction") - values["coulomb_friction"]
    del values["limit_velocity"]
    return {**values, CLOCK_OFFSET: 0.0, START: float(start)}


def perfect_record(recording):
    """A record as it is, not smoothed, not thinned out."""
    pressure = recording.pressure
    return ConditionedRecord(
        recording.sample_period, pressure, (pressure, pressure), recording.position, 0.0, 1, 1
    )


def perfect_problem(valve, recording, **settings):
    return OutputError(perfect_record(recording), valve, **settings)
