"""Files that figures can be saved to."""

from pathlib import Path

from matplotlib.figure import Figure

__all__ = ["require_picture_file"]


def require_picture_file(path: Path) -> None:
    """Refuse a file that a figure cannot be saved to, before the work begins.

    Raises
    ------
    ValueError
        If the ending is not a picture format, or the folder does not exist; the message names it.
    """
    endings = Figure().canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in endings:
        raise ValueError(
            f"{path}: the ending is not a picture format; choose from .{', .'.join(endings)}"
        )
    if not path.parent.is_dir():
        raise ValueError(
            f"{path}: the folder {path.parent} does not exist: create it, or name another folder"
        )
