"""Why a file could not be read, in words."""

__all__ = ["cause_of"]


def cause_of(error: Exception) -> str:
    """Return the system's words for an error of its own; else the error's."""
    return str((isinstance(error, OSError) and error.strerror) or error)
