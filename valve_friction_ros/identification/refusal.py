"""Refusal of a record that cannot be identified."""

__all__ = ["RefusalError"]


class RefusalError(Exception):
    """The record does not support an identification; the message says why and what to do."""
