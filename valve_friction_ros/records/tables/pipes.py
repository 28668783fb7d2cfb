"""Standard input and pipes, which can be read once, as files."""

import atexit
import functools
import shutil
import stat
import sys
import tempfile
from pathlib import Path

__all__ = ["STANDARD_INPUT", "readable"]

STANDARD_INPUT = Path("-")
_PIECE = 1 << 20


@functools.cache
def _copy(path: Path, most: float) -> Path:
    """Copy a pipe to a file that goes with the process."""
    folder = tempfile.mkdtemp(prefix="valve_friction_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    target = Path(folder, "pipe")
    source = sys.stdin.buffer if path == STANDARD_INPUT else path.open("rb")
    size = 0
    with target.open("wb") as whole, source:
        while piece := source.read(_PIECE):
            size += len(piece)
            if size > most * 1e6:
                raise ValueError(
                    f"{path}: more than {most:g} MB: raise maximum_megabytes "
                    "(--maximum-megabytes), or cut it"
                )
            whole.write(piece)
    return target


def readable(path: Path, most: float) -> Path:
    """Return a file with the content of `path`, standard input and pipes among them.

    The copy of a pipe holds at most `most` MB; ValueError where that is not enough.
    """
    try:
        is_pipe = path == STANDARD_INPUT or stat.S_ISFIFO(path.stat().st_mode)
        return _copy(path, most) if is_pipe else path
    except OSError:
        return path  # whoever opens it says why that fails
