"""Files that figures are saved to."""

import io
from pathlib import Path

from matplotlib.figure import Figure

from valve_friction_ros.records.whole_file import write_whole

__all__ = ["require_picture_file", "save_picture"]


def _format(path: Path) -> str:
    return path.suffix.lstrip(".").lower()


def require_picture_file(path: Path) -> None:
    """Refuse a file that a figure cannot be saved to, before the work begins.

    Raises
    ------
    ValueError
        If the ending is not a picture format, or the folder does not exist; the message names it.
    """
    endings = Figure().canvas.get_supported_filetypes()
    if _format(path) not in endings:
        raise ValueError(f"{path}: the ending is not a picture format; choose .png, .pdf or .svg")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}: create it, or name another")


def save_picture(figure: Figure, path: Path) -> None:
    """Draw a figure into a file in the format of its ending.

    Raises
    ------
    OSError
        If it cannot be written; it names `path`, and no part of the picture stays.
    """
    content = io.BytesIO()
    figure.savefig(content, format=_format(path))
    write_whole(path, content.getvalue())
