"""Units of recorded files, and their sizes in SI units."""

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "FORCE_UNITS",
    "NANOSECONDS",
    "PERCENT",
    "POSITION_UNITS",
    "PRESSURE_UNITS",
    "Unit",
    "unit_named",
]


class Unit(NamedTuple):
    """Size of a unit as a ratio, so that decimals are converted with one rounding only.

    3.7 mm is 3.7/1000 m to the last bit, which 3.7·0.001 is not.

    Attributes
    ----------
    multiplier, divisor : float
        One of this unit is multiplier/divisor of the SI unit.
    """

    multiplier: float
    divisor: float = 1.0

    def to_si(self, values: "NDArray[np.float64]") -> "NDArray[np.float64]":
        """Convert values in this unit."""
        return values * self.multiplier / self.divisor


_POUND_FORCE = 4.4482216152605
_KILOGRAM_FORCE = 9.80665
"""N: exact by definition, the pound of 0.45359237 kg and the standard gravity of 9.80665 m/s²."""

PRESSURE_UNITS = MappingProxyType(
    {
        "Pa": Unit(1),
        "hPa": Unit(100),
        "kPa": Unit(1e3),
        "MPa": Unit(1e6),
        "mbar": Unit(100),
        "bar": Unit(1e5),
        "psi": Unit(_POUND_FORCE, 6.4516e-4),
        "kgf/cm2": Unit(_KILOGRAM_FORCE, 1e-4),
        "inH2O": Unit(249.08891),
        "inHg": Unit(3386.389),
        "mmHg": Unit(133.322387415),
    }
)

POSITION_UNITS = MappingProxyType(
    {
        "m": Unit(1),
        "cm": Unit(1, 100),
        "mm": Unit(1, 1e3),
        "um": Unit(1, 1e6),
        "in": Unit(254, 1e4),
    }
)

PERCENT = "percent"
"""Unit of a position as a share of the travel; the valve gives its size."""

FORCE_UNITS = MappingProxyType(
    {
        "N": Unit(1),
        "kN": Unit(1e3),
        "lbf": Unit(_POUND_FORCE),
        "kgf": Unit(_KILOGRAM_FORCE),
    }
)

NANOSECONDS = MappingProxyType(
    {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000, "min": 60_000_000_000}
)
"""Units of time in nanoseconds, the unit of all stamps."""

_OTHER_NAMES = MappingProxyType(
    {
        "%": PERCENT,
        "µm": "um",
        "μm": "um",
        "µs": "us",
        "μs": "us",
        "sec": "s",
        '"': "in",
        "inch": "in",
        "psig": "psi",
        "psia": "psi",
        "barg": "bar",
        "bara": "bar",
        "kg/cm2": "kgf/cm2",
        "kg/cm²": "kgf/cm2",
        "kgf/cm²": "kgf/cm2",
    }
)


def unit_named(name: str) -> str:
    """Return the name that this module has for a unit; an unknown one as it is."""
    return _OTHER_NAMES.get(name, name)
