# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Work in another thread, awaited by a callback, and the report of a bug in it."""

import contextlib
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ParamSpec, TypeVar

from rclpy.node import Node
from rclpy.task import Future

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.processes import ElsewhereError

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


class InternalError(Exception):
    """A bug of this package, in one line for the caller; its traceback is in the log."""


def _internal_error(bug: Exception) -> InternalError:
    if isinstance(cause := bug.__cause__, ElsewhereError):
        file, line = cause.file, cause.line
    else:
        place = traceback.extract_tb(bug.__traceback__)[-1]
        file, line = place.filename, place.lineno or 0
    words = " ".join(f"{type(bug).__name__}: {bug}".split())
    where = f"{Path(file).name}, line {line}"
    return InternalError(f"internal error: {words} ({where}): report it, with what ~/save writes")


@contextlib.contextmanager
def bugs_reported(
    node: Node, *expected: type[Exception], known: str | None = None
) -> Iterator[None]:
    """Turn a bug into an InternalError, and log its traceback.

    An exception that leaves a callback would end the node, with all valves of its process.
    RefusalError and the `expected` exceptions are no bugs, and pass unchanged. An internal error
    that is `known`, in the log already, is not logged again.
    """
    passed: tuple[type[Exception], ...] = (RefusalError, InternalError, *expected)
    try:
        yield
    except passed:
        raise
    except Exception as bug:
        error = _internal_error(bug)
        if str(error) != known:
            node.get_logger().error(f"{error}\n{''.join(traceback.format_exception(bug))}")
        raise error from bug


async def done_in(
    pool: ThreadPoolExecutor,
    work: Callable[_Arguments, _Result],
    *arguments: _Arguments.args,
    **named: _Arguments.kwargs,
) -> _Result:
    """Do some work in a thread of `pool`, while the executor goes on.

    For callbacks that are coroutines, in a callback group that lets others run meanwhile. Returns
    what the work returns, and raises what it raises, in the executor's thread.
    """
    finished = Future()
    pool.submit(work, *arguments, **named).add_done_callback(finished.set_result)
    result: _Result = (await finished).result()
    return result
