"""Arguments that sub-commands share, and what they stand for."""
