"""How numbers are written for people."""

__all__ = ["two_digits"]


def two_digits(value: float) -> str:
    """Write a size with two digits, or all of its whole ones, and without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"
