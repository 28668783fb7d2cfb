"""Rows of a history on their way to another one: a copy, and what a file sends to a server."""

from valve_friction_ros.history.copying.copy import CopiedPart, copied, is_there
from valve_friction_ros.history.copying.sender import Sender, SentState, sender_of

__all__ = ["CopiedPart", "Sender", "SentState", "copied", "is_there", "sender_of"]
