"""What the object of JSON and the table of `identify` say."""

import math

__all__ = ["KEYS", "PARAMETER_KEYS", "column", "known", "none_for_nan", "row_of", "values"]

KEYS = {
    "method",
    "parameters",
    "fit",
    "rms",
    "sliding_speed",
    "systematic_misfit",
    "model_describes",
    "derivative_window",
    "evidence",
    "settings",
    "warnings",
}

PARAMETER_KEYS = {
    "value",
    "standard_error",
    "half_width",
    "interval",
    "verdict",
    "reason",
    "published",
    "unit",
}


def column(answer, key):
    """One entry of every parameter by name."""
    return {name: entry[key] for name, entry in answer["parameters"].items()}


def values(answer):
    return column(answer, "value")


def known(answer):
    """The values that are not withheld."""
    return {name: value for name, value in values(answer).items() if value is not None}


def none_for_nan(value):
    return None if math.isnan(value) else value


def row_of(out, name):
    """The row of a parameter in the printed table, without doubled spaces."""
    (row,) = (line for line in out.split("\n\n")[0].splitlines() if line.split()[0] == name)
    return " ".join(row.split())
