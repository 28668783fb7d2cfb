"""What a result of the programme must hold, or the programme ends."""

from valve_friction_ros.identification import Result, ValveSignature
from valve_friction_ros.model import KarnoppParameters

__all__ = ["model_of", "signature_of"]


def model_of(result: Result) -> KarnoppParameters:
    """Return the identified model; raises ValueError where its values are impossible."""
    if result.model is None:
        raise ValueError(f"the values of method {result.method} make no model")
    return result.model


def signature_of(result: Result) -> ValveSignature:
    """Return the valve signature; raises ValueError for a method without one."""
    if result.signature is None:
        raise ValueError(f"the method {result.method} has no valve signature")
    return result.signature
