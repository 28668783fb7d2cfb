"""The libraries that bags need, which are no part of the package's own requirements."""

import contextlib
from collections.abc import Iterator

__all__ = ["bag_libraries"]

_LIBRARIES = ("rosbags", "lz4", "backports")
"""Top-level modules. rosbags itself asks for the others."""

_REMEDY = "run `pip install 'rosbags>=0.11.9,<0.12' lz4 backports.zstd`"


@contextlib.contextmanager
def bag_libraries() -> Iterator[None]:
    """Import modules of this room that need rosbags, lz4 and backports.zstd within this block.

    Raises ValueError, which says what to install, if one of these is not there, or is another
    version.
    """
    try:
        yield
    except ImportError as error:
        library = (error.name or "").partition(".")[0]
        if library not in _LIBRARIES:
            raise
        raise ValueError(
            f"bags need rosbags, lz4 and backports.zstd ({error}): {_REMEDY}"
        ) from None
