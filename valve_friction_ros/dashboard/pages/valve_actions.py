"""The buttons of the page *Valve*: what is asked of the identifier, its progress and its answer."""

import time
from collections.abc import Callable
from typing import NamedTuple

from nicegui import ui

from valve_friction_ros.dashboard.graph import Answer, Operator
from valve_friction_ros.dashboard.heard.status_keys import Quantity
from valve_friction_ros.dashboard.heard.valve_view import ValveView
from valve_friction_ros.dashboard.pages.theme import element
from valve_friction_ros.dashboard.plant_rows import quantity_texts
from valve_friction_ros.outside_text import printable

__all__ = ["Question", "ValveActions", "question_of", "why_no_baseline"]

_ACTIONS = {
    "identify": ("Identify", "identifying"),
    "save": ("Save recording", "saving"),
    "report": ("Write report", "writing the report"),
    "set_baseline": ("Set baseline …", "setting the baseline"),
    "restore_baseline": ("Restore baseline …", "restoring the baseline"),
}


def _size(one: Quantity) -> str:
    return " ".join(filter(None, (one.name.replace("_", " "), *quantity_texts(one), one.unit)))


def _frictions(found: tuple[Quantity, ...]) -> str:
    return "; ".join(map(_size, found)) or "none"


class Question(NamedTuple):
    """What is asked before a baseline changes: of which valve and estimate, and from what to what.

    `identified` is the time of the estimate that a baseline is set from, ns since 1970.
    """

    tag: str
    identified: int | None
    old: str
    new: str


def question_of(view: ValveView, new: str | None) -> Question:
    """Return what to ask of a valve; `new` None: the baseline is set from the estimate."""
    return Question(
        view.tag,
        view.identified if new is None else None,
        _frictions(view.baseline),
        _frictions(_estimate(view)) if new is None else new,
    )


def why_no_baseline(view: ValveView) -> str:
    """Return why no baseline can be set; empty if it can."""
    if _estimate(view):
        return ""
    return view.reason or "There is no estimate of the friction: identify the valve first."


def _estimate(view: ValveView) -> tuple[Quantity, ...]:
    found = (
        view.parameter(name).if_determined for name in ("coulomb_friction", "sliding_friction")
    )
    return tuple(one for one in found if one.is_known)


class ValveActions:
    """Buttons that call the services of one identifier, one call at a time.

    Parameters
    ----------
    operator : Operator
        Calls the services.
    node : str
        The identifier.
    now : callable
        Returns what is known of the valve.
    replaced : callable
        Says in words which baseline a restoration would bring back.
    done : callable
        Called with the name of a service that has answered.
    """

    def __init__(
        self,
        operator: Operator,
        node: str,
        now: Callable[[], ValveView],
        replaced: Callable[[], str],
        done: Callable[[str], None],
    ) -> None:
        self._operator, self._node = operator, node
        self._now, self._replaced, self._done = now, replaced, done
        self._busy: tuple[str, float] | None = None
        self._buttons: list[ui.button] = []

    def draw(self) -> None:
        """Draw the buttons and the line of the answer."""
        with element("div", "vf-actions", role="group", aria_label="Actions"):
            for service, (title, _) in _ACTIONS.items():
                self._buttons.append(self._button(service, title))
        self._says = ui.label("").classes("vf-answer")
        self._says.props["role"] = "status"
        self._says.set_visibility(False)

    def _button(self, service: str, title: str) -> ui.button:
        async def act() -> None:
            if service in ("set_baseline", "restore_baseline") and not await self._agreed(service):
                return
            await self._call(service)

        made = ui.button(title, on_click=act, color=None).props("no-caps unelevated dense")
        if service == "set_baseline":
            with made:
                self._why = ui.tooltip("")
        return made.classes("vf-act" + (" vf-act-first" if service == "identify" else ""))

    async def _agreed(self, service: str) -> bool:
        """Show the old and the new baseline, and ask; again where they have changed meanwhile."""
        shown, agreed = None, True
        while agreed and shown != (question := self._question(service)):
            agreed = await self._asked(service, question, is_again=shown is not None)
            shown = question
        return agreed

    def _question(self, service: str) -> Question:
        new = None if service == "set_baseline" else self._replaced()
        return question_of(self._now(), new)

    async def _asked(self, service: str, question: Question, is_again: bool) -> bool:
        is_set = service == "set_baseline"
        with ui.dialog() as dialog, ui.card().classes("vf-dialog"):
            dialog.props["aria-label"] = _ACTIONS[service][0]
            ui.label(f"{'Set' if is_set else 'Restore'} the baseline of {question.tag}?").classes(
                "vf-dialog-title"
            )
            if is_again:
                ui.label("This has changed while you were asked:").classes("vf-reason")
            for name, words in (
                ("in force now", question.old),
                ("from then on", question.new),
            ):
                with element("div", "vf-pair"):
                    ui.label(name)
                    ui.label(words)
            ui.label(
                "All later diagnoses compare with it: set it on a healthy valve only."
                if is_set
                else "This undoes the last setting of the baseline."
            ).classes("vf-none")
            with element("div", "vf-actions"):
                ui.button("Cancel", on_click=lambda: dialog.submit(False), color=None).props(
                    "flat no-caps autofocus"
                )
                ui.button(
                    "Set baseline" if is_set else "Restore baseline",
                    on_click=lambda: dialog.submit(True),
                    color=None,
                ).props("unelevated no-caps").classes("vf-act-first")
        agreed = bool(await dialog)
        dialog.delete()
        return agreed

    async def _call(self, service: str) -> None:
        if self._busy is not None:
            return
        self._busy = (service, time.monotonic())
        for button in self._buttons:
            button.disable()
        self._say("busy", f"{_ACTIONS[service][1]} …")
        try:
            answer = await self._operator.call(self._node, service)
        except Exception as error:  # noqa: BLE001 - a bug shall not leave the buttons dead
            answer = Answer(False, f"the call has failed: {error}")
        self._busy = None
        self._enable()
        title = _ACTIONS[service][0].rstrip(" …")
        words = printable(answer.message, 2000) or "done"
        self._say("ok" if answer.success else "error", f"{title}: {words}")
        self._done(service)

    def _say(self, state: str, words: str) -> None:
        self._says.classes(replace=f"vf-answer vf-answer-{state}")
        self._says.set_visibility(True)
        self._says.set_text(words)

    def _enable(self) -> None:
        """Enable the buttons; not that which would set a baseline without an estimate."""
        why = why_no_baseline(self._now())
        for service, button in zip(_ACTIONS, self._buttons, strict=True):
            is_possible = not (service == "set_baseline" and why)
            button.set_enabled(is_possible)
        self._why.set_text(why)
        self._why.set_visibility(bool(why))

    def tick(self) -> None:
        """Show for how long a call has been under way, and which one is possible."""
        if self._buttons and self._busy is None:
            self._enable()
        if self._busy is not None:
            service, begin = self._busy
            self._says.set_text(f"{_ACTIONS[service][1]} … {time.monotonic() - begin:.0f} s")
