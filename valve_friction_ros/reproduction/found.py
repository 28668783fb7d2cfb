"""Parts that a result of the programme must hold."""

from valve_friction_ros.identification import Result, ValveSignature
from valve_friction_ros.model import KarnoppParameters

__all__ = ["model_of", "signature_of"]


def model_of(result: Result) -> KarnoppParameters:
    """Return the identified model; raise ValueError if its values are impossible."""
    if result.model is None:
        raise ValueError(f"the values of method {result.method} are impossible for a model")
    return result.model


def signature_of(result: Result) -> ValveSignature:
    """Return the valve signature; raise ValueError if the method has none."""
    if result.signature is None:
        raise ValueError(f"the method {result.method} has no valve signature")
    return result.signature
