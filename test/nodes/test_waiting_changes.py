"""What is given up of the changes that wait for the history: identifications first, counted."""

from functools import partial

from valve_friction_ros.nodes.identifier.waiting_changes import WaitingChanges


def change(name):
    return partial(print, name)


def drained(waiting):
    names = []
    while (one := waiting.first()) is not None:
        names.append(one.args[0])
        waiting.remove(one)
    return names


def test_identifications_go_first_and_the_order_stays():
    waiting = WaitingChanges(most=4)
    waiting.add(change("baseline"))
    for k in range(5):
        waiting.add(change(f"identified {k}"), identification=True)
    waiting.add(change("renewal"))
    assert waiting.given_up == "3 identifications"
    assert drained(waiting) == ["baseline", "identified 3", "identified 4", "renewal"]


def test_without_identifications_the_oldest_goes():
    waiting = WaitingChanges(most=2)
    for k in range(3):
        waiting.add(change(k))
    assert waiting.given_up == "1 other change"
    waiting.add(change("identified"), identification=True)
    assert waiting.given_up == "1 identification and 1 other change"
    waiting.forget_given_up()
    assert waiting.given_up == ""
    assert drained(waiting) == [1, 2]


def test_a_change_waits_once_and_may_go_while_it_is_made():
    waiting, one = WaitingChanges(most=1), change("made")
    waiting.add(one)
    waiting.add(one)
    assert waiting.given_up == ""
    waiting.add(change("next"))
    waiting.remove(one)
    assert drained(waiting) == ["next"]
