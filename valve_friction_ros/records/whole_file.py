# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files: written whole or not at all; and why one cannot be read."""

import contextlib
import os
from pathlib import Path


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


def cause_of(error: Exception) -> str:
    """Return the system's words for an error of its own; else the error's."""
    return str((isinstance(error, OSError) and error.strerror) or error)
