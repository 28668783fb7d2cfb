"""Work shared out to processes."""

import os
import signal

from valve_friction_ros.fleet import DeadWorker, in_processes


def work(task):
    """Do what the task says: tell the process, leave it, or be killed."""
    if task == "leave":
        os._exit(3)
    if task == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getpid(), os.environ["OPENBLAS_NUM_THREADS"], os.environ["NUMBA_NUM_THREADS"]


def never():
    return False


def test_a_death_is_told_with_its_task_and_replaced(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    tasks = ["a", "leave", "b", "kill", "c"]
    answers = list(in_processes(work, tasks, 1, never))
    assert [task for task, _ in answers] == tasks
    first, left, second, killed, third = (answer for _, answer in answers)
    assert isinstance(left, DeadWorker)
    assert isinstance(killed, DeadWorker)
    assert len({first, second, third}) == 3
    assert {answer[1:] for answer in (first, second, third)} == {("1", "1")}
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"
    assert str(left) == "its process ended with exit code 3"
    assert "SIGKILL" in str(killed)
    assert "memory" in str(killed)


def test_no_more_processes_than_tasks_and_each_is_used_again():
    answers = dict(in_processes(work, "abcde", 2, never))
    assert sorted(answers) == list("abcde")
    assert len({pid for pid, *_ in answers.values()}) <= 2
    assert os.getpid() not in {pid for pid, *_ in answers.values()}
    assert list(in_processes(work, [], 3, never)) == []


def test_stopped_before_the_first_answer():
    assert list(in_processes(work, "abc", 1, lambda: True)) == []


def test_closed_early_its_processes_are_gone():
    answers = in_processes(work, "abcdef", 2, never)
    _, (pid, *_) = next(answers)
    answers.close()
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return
    raise AssertionError("the process is still there")
