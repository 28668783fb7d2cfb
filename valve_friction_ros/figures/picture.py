"""Files that figures can be saved to."""

from pathlib import Path

from matplotlib.figure import Figure

__all__ = ["require_picture_file"]


def require_picture_file(path: Path) -> None:
    """Refuse a file that a figure cannot be saved to, before long work is done for it.

    Raises
    ------
    ValueError
        If the ending is no picture format, or the folder is not there; the message names it.
    """
    endings = Figure().canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in endings:
        raise ValueError(f"{path}: not a picture format; choose from .{', .'.join(endings)}")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}")
