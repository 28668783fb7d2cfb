"""Numbers as people read them."""

__all__ = ["percentage", "two_digits"]


def two_digits(value: float) -> str:
    """Write a size with two significant digits, from 100 on as a whole number; no exponent."""
    return f"{value:.2g}" if abs(value) < 99.5 else f"{value:.0f}"


def percentage(share: float) -> str:
    """Write a share in percent: two significant digits, whole percents from 100 % on."""
    return f"{two_digits(100 * share)} %"
