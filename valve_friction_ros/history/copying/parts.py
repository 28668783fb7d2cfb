"""What a history holds of a valve, in parts that are copied by their keys."""

from dataclasses import dataclass

__all__ = ["PARTS", "Part", "part_named"]


@dataclass(frozen=True)
class Part:
    """A table with rows of valves.

    Attributes
    ----------
    table : str
        Its name.
    key : tuple of str
        The columns that tell the rows of one valve apart, in each history alike.
    is_kept : bool
        Whether a row stays as it is once it was written, so that it is never sent again.
    children : tuple of str
        Tables whose rows belong to a row of this one, and came with it.
    is_numbered : bool
        Whether its rows have numbers, ``id``, in the order in which they were kept.
    """

    table: str
    key: tuple[str, ...]
    is_kept: bool = False
    children: tuple[str, ...] = ()
    is_numbered: bool = False

    @property
    def order(self) -> str:
        """The columns by which its rows stand in the order in which they were kept, or sorted."""
        return "id" if self.is_numbered else ", ".join(("valve_id", *self.key))

    @property
    def parent_column(self) -> str:
        """The column by which the children name their row."""
        return f"{self.table}_id"


PARTS = (
    Part("identification", ("uid",), True, ("parameter", "identification_number"), True),
    Part("baseline", ("uid",), True, ("baseline_number", "baseline_record"), True),
    Part("packing_renewal", ("time_ns",), True),
    Part("usage", ("renewal_ns", "day", "run")),
    Part("alarm_recording", ("path",)),
    Part("told_level", ()),
    Part("move", ("end_ns",)),
    Part("evidence_reference", ()),
    Part("evidence_change", ()),
    Part("answer", ("stamp",), is_numbered=True),
)
"""All parts, in the order in which they are copied."""


def part_named(table: str) -> Part:
    """Return the part of a table."""
    return next(one for one in PARTS if one.table == table)
