"""A case made into a record: what the sensors wrote, and what is true."""

from dataclasses import dataclass, replace
from functools import lru_cache

from benchmark.reality.excitations import Excitation, drive
from benchmark.reality.plants import Motion, Plant, move
from benchmark.reality.sensors import Instruments, Signal, measured
from benchmark.reality.truth import Truth, truth_of

__all__ = ["Case", "Nominal", "Record", "make_record"]


@dataclass(frozen=True)
class Case:
    """One record to be made.

    Attributes
    ----------
    imperfection, label : str
        Class of the imperfection, and which of that class.
    packing : str
        Name of the packing.
    plant : Plant
        The valve as it is.
    instruments : Instruments
        Sensors and clocks.
    excitation : Excitation
        The drive.
    seed : int
        Of drive and sensors.
    words : tuple of str
        Beginnings of words, in lower case, of which one at least names the imperfection.
    reference : Plant
        The valve when its baseline was taken.
    growth : float
        Friction over that of the baseline.
    """

    imperfection: str
    label: str
    packing: str
    plant: Plant
    instruments: Instruments
    excitation: Excitation
    seed: int
    words: tuple[str, ...]
    reference: Plant
    growth: float = 1.0

    @property
    def name(self) -> str:
        """The case in one line, the same in each run."""
        grown = f" ×{self.growth:g}" if self.growth != 1.0 else ""
        what = f"{self.imperfection}: {self.label}" if self.label else self.imperfection
        return f"{what} | {self.packing}{grown} | {self.excitation.kind.value} | {self.seed}"

    @property
    def is_ideal(self) -> bool:
        """Whether nothing is imperfect."""
        return self.imperfection == "ideal"

    def ideal(self, seed: int) -> "Case":
        """Return the same plant under the same drive with nothing imperfect, for a baseline."""
        return replace(
            self,
            imperfection="ideal",
            label="",
            plant=self.reference,
            instruments=Instruments(),
            seed=seed,
            words=(),
            growth=1.0,
        )


@dataclass(frozen=True)
class Nominal:
    """What the user of the identification knows of the valve.

    Attributes
    ----------
    diaphragm_area, pressure_reference, travel : float
        S_a (m²), P_ref (Pa) and the travel (m).
    pressure_minimum, pressure_maximum : float
        Range of the pressure sensor, Pa.
    """

    diaphragm_area: float
    pressure_reference: float
    travel: float
    pressure_minimum: float = -20e3
    pressure_maximum: float = 270e3


@dataclass(frozen=True, eq=False)
class Record:
    """A record as it was written, and the truth about it.

    Attributes
    ----------
    case : Case
        What it is of.
    nominal : Nominal
        The valve as its user describes it.
    pressure, position : Signal
        Stamps (ns) and values (Pa, m) of each.
    truth : Truth
        What is true.
    """

    case: Case
    nominal: Nominal
    pressure: Signal
    position: Signal
    truth: Truth


@lru_cache(maxsize=2)
def _motion(plant: Plant, excitation: Excitation, seed: int) -> Motion:
    return move(plant, *drive(excitation, seed))


def make_record(case: Case) -> Record:
    """Make a record; the same each time, to the last bit.

    The motion of a valve is kept for the next record of it, so cases that differ in their
    instruments only are best made in a row.
    """
    motion = _motion(case.plant, case.excitation, case.seed)
    duration = case.excitation.duration
    pressure, position = measured(motion, case.instruments, duration, case.seed)
    body = case.plant.body
    return Record(
        case,
        Nominal(body.area, body.pressure_reference, body.travel),
        pressure,
        position,
        truth_of(case.plant, motion, case.instruments, duration),
    )
