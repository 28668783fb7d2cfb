"""Files that are written whole or not at all."""

import contextlib
import os
from pathlib import Path

__all__ = ["write_whole"]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file; a failure leaves no part of it, and keeps what was there before.

    A link stays a link, a device or a pipe is written to as it is. Raises OSError, which names
    `path`.
    """
    place = path.resolve()
    is_special = place.exists() and not place.is_file()
    draft = place if is_special else place.with_name(f".{os.getpid()}_{place.name}")
    try:
        draft.write_bytes(content)
        if not is_special:
            draft.replace(place)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        if not is_special:
            with contextlib.suppress(OSError):  # a read-only folder holds no draft
                draft.unlink(missing_ok=True)
