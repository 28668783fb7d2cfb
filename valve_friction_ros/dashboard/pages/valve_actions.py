"""The buttons of the page *Valve*: what is asked of the identifier, its progress and its answer."""

import time
from collections.abc import Callable

from nicegui import ui

from valve_friction_ros.dashboard.graph import Answer, Operator
from valve_friction_ros.dashboard.pages.theme import element
from valve_friction_ros.dashboard.status_keys import Quantity
from valve_friction_ros.dashboard.valve_view import ValveView
from valve_friction_ros.identification import two_digits
from valve_friction_ros.outside_text import printable

__all__ = ["ValveActions"]

_ACTIONS = {
    "identify": ("Identify", "identifying"),
    "save": ("Save recording", "saving"),
    "report": ("Write report", "writing the report"),
    "set_baseline": ("Set baseline …", "setting the baseline"),
    "restore_baseline": ("Restore baseline …", "restoring the baseline"),
}


def _size(one: Quantity) -> str:
    width = f" ± {two_digits(one.half_width)}" if one.half_width > 0 else ""
    return f"{one.name.replace('_', ' ')} {one.value:.4g}{width} {one.unit}"


def _frictions(found: tuple[Quantity, ...]) -> str:
    return "; ".join(map(_size, found)) or "none"


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
        return made.classes("vf-act" + (" vf-act-first" if service == "identify" else ""))

    async def _agreed(self, service: str) -> bool:
        """Show the old and the new baseline, and ask."""
        view = self._now()
        is_set = service == "set_baseline"
        frictions = tuple(
            one
            for one in map(view.parameter, ("coulomb_friction", "sliding_friction"))
            if one.is_known
        )
        with ui.dialog() as dialog, ui.card().classes("vf-dialog"):
            dialog.props["aria-label"] = _ACTIONS[service][0]
            ui.label(f"{'Set' if is_set else 'Restore'} the baseline of {view.tag}?").classes(
                "vf-dialog-title"
            )
            for name, words in (
                ("in force now", _frictions(view.baseline)),
                ("from then on", _frictions(frictions) if is_set else self._replaced()),
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
        for button in self._buttons:
            button.enable()
        title = _ACTIONS[service][0].rstrip(" …")
        words = printable(answer.message, 2000) or "done"
        self._say("ok" if answer.success else "error", f"{title}: {words}")
        self._done(service)

    def _say(self, state: str, words: str) -> None:
        self._says.classes(replace=f"vf-answer vf-answer-{state}")
        self._says.set_visibility(True)
        self._says.set_text(words)

    def tick(self) -> None:
        """Show for how long a call has been under way."""
        if self._busy is not None:
            service, begin = self._busy
            self._says.set_text(f"{_ACTIONS[service][1]} … {time.monotonic() - begin:.0f} s")
