"""Work in another thread, of which no failure may end the node."""

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

from valve_friction_ros.identification import RefusalError

__all__ = ["guarded"]

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def guarded(
    work: Callable[_Arguments, _Result], *foreseen: type[Exception]
) -> Callable[_Arguments, _Result]:
    """Return the same work, which turns a failure that nobody foresaw into a RefusalError.

    Refusals, and errors of the kinds `foreseen`, pass as they are. Of any other the refusal tells
    the kind, the words and the line that raised it. Raised in the executor's thread instead, it
    would end the node, with all valves of its process, and leave who asked without an answer.
    """
    passed: tuple[type[Exception], ...] = (RefusalError, *foreseen)

    def work_or_refuse(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> _Result:
        try:
            return work(*arguments, **named)
        except passed:
            raise
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            words = " ".join(str(error).split())
            where = f"{Path(place.filename).name}, line {place.lineno}"
            raise RefusalError(
                f"unexpected {type(error).__name__}: {words} ({where}): report it, "
                "with what ~/save writes"
            ) from error

    return work_or_refuse
