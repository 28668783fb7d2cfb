"""The methods of identification by name; all have the same arguments and return type."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

from valve_friction_ros.identification.published import method as published
from valve_friction_ros.identification.refined import method as refined
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.robust import method as robust
from valve_friction_ros.identification.settings import DEFAULT_METHOD, IdentificationSettings
from valve_friction_ros.identification.signature import force_balance as signature
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve

__all__ = [
    "FORMER_METHODS",
    "METHODS",
    "Method",
    "identify",
    "method_named",
    "method_used",
]


class Method(Protocol):
    """A method of identification: from a record to parameters with verdicts."""

    def __call__(
        self, recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
    ) -> Result:
        """Identify a record; raise RefusalError if it does not determine the friction."""


BEST = "best"
"""Name of the choice between ``robust`` and ``refined``."""


def identify_best(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Result:
    """Identify with ``robust``; with ``refined`` where the settings ask for what only that has.

    These are a known position bias and a known static friction. The result names the method that
    was used. It raises RefusalError as that method does.
    """
    settings = settings or IdentificationSettings()
    return METHODS[method_used(BEST, settings)](recording, valve, settings)


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        BEST: identify_best,
        robust.METHOD: robust.identify_robust,
        refined.METHOD: refined.identify_refined,
        published.METHOD: published.identify_published,
        signature.METHOD: signature.identify_signature,
    }
)
"""``best``: ``robust`` wherever it applies; ``robust``: with the imperfections of a plant in the
fit; ``refined``: the Karnopp model alone; ``published``: the paper's model 1; ``signature``: its
model 2."""

FORMER_METHODS: Mapping[str, str] = MappingProxyType(
    {"sweep": refined.METHOD, "force_balance": signature.METHOD}
)
"""Names that files of earlier versions use, and what they are called now."""


def method_used(name: str, settings: IdentificationSettings) -> str:
    """Return the name of the method that identifies with these settings: ``best`` is a choice."""
    if name != BEST:
        return name
    return refined.METHOD if robust.has_no_place_for(settings) else robust.METHOD


def method_named(name: str) -> Method:
    """Return the method of this name.

    Raises
    ------
    ValueError
        If no method has this name; the message lists the names.
    """
    if name not in METHODS:
        former = FORMER_METHODS.get(name)
        hint = f"it is now called {former!r}" if former else f"choose from {', '.join(METHODS)}"
        raise ValueError(f"there is no method {name!r}: {hint}")
    return METHODS[name]


def identify(
    recording: Recording,
    valve: Valve,
    settings: IdentificationSettings | None = None,
    method: str = DEFAULT_METHOD,
) -> Result:
    """Identify the friction of a valve from a recording.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position, several strokes in both directions.
    valve : Valve
        Geometry.
    settings : IdentificationSettings, optional
        What is known beforehand, and the settings of the sweep.
    method : str
        ``best``; ``robust``, with the imperfections of a plant in the fit; ``refined``, with the
        Karnopp model alone; ``published``, the paper's model 1; or ``signature``, the paper's
        model 2, from a slow triangular wave.

    Returns
    -------
    Result
        Parameters with intervals and verdicts.

    Raises
    ------
    RefusalError
        If the record does not determine the friction; the message names cause and remedy.
    ValueError
        If no method has this name.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> packing = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
    >>> time = np.arange(4000) / 100
    >>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
    >>> stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
    >>> result = vf.identify(vf.Recording(0.01, pressure, stem.position), valve)
    >>> friction = result.parameters["coulomb_friction"]
    >>> low, high = friction.interval
    >>> low < 150.0 < high
    True
    """
    return method_named(name=method)(recording, valve, settings)
