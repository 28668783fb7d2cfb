# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tasks shared out to processes and to a cluster, some of which die."""

import os
import signal
import socket
import threading

import pytest
from dask_workers import answer, local_cluster

from valve_friction_ros.fleet import DeadWorker, cluster_at, in_cluster, in_processes
from valve_friction_ros.fleet import workers as sharing


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


pytest.importorskip("distributed", reason="run `make venv-cluster`")

pytestmark = pytest.mark.timeout(300)  # processes start, die and come back


@pytest.fixture(scope="module")
def address():
    with local_cluster() as found:
        yield found.scheduler_address


@pytest.fixture
def workers(address):
    with cluster_at(address) as found:
        yield found


def test_each_task_is_answered_once(workers):
    tasks = [f"{number}" for number in range(100)]
    found = list(in_cluster(workers, answer, tasks, never))
    assert sorted(task for task, _ in found) == sorted(tasks)
    assert {threads for _, (_, threads) in found} == {"1"}
    assert list(in_cluster(workers, answer, [], never)) == []


def test_a_death_costs_its_own_task_only(workers, tmp_path):
    """The tasks of its batch, and those that waited beside it, are answered all the same."""
    tasks = [f"{number}" for number in range(40)]
    tasks[3:3] = ["kill"]
    tasks[20:20] = [f"once {tmp_path / 'first'}", "raise"]
    found = dict(in_cluster(workers, answer, tasks, never))
    assert found.keys() == set(tasks)
    dead = {task: said for task, said in found.items() if isinstance(said, DeadWorker)}
    assert dead.keys() == {"kill", "raise"}
    assert "its worker process died 1 time, last on tcp://" in str(dead["kill"])
    assert str(dead["raise"]) == "unexpected RuntimeError of its worker: of two lines"


def test_what_is_handed_out_is_bounded(workers, monkeypatch):
    sizes, kept = [], sharing._Run._hand_out

    def hand_out(run, tasks, is_alone=False):
        kept(run, tasks, is_alone)
        sizes.append((len(tasks), len(run._out)))

    monkeypatch.setattr(sharing._Run, "_hand_out", hand_out)
    found = in_cluster(workers, answer, [f"{number}" for number in range(300)], never)
    assert len(list(found)) == 300
    assert sum(size for size, _ in sizes) == 300
    assert max(size for size, _ in sizes) == 16
    assert max(out for _, out in sizes) == 2
    assert [size for size, _ in sizes][-4:] == [1, 1, 1, 1]


def test_stopped_while_a_worker_is_busy(workers, tmp_path):
    """What waits is given up; the worker ends what it has, and is free again."""
    begun = tmp_path / "begun"
    found = list(in_cluster(workers, answer, [f"wait {begun}", *"abcdef"], begun.exists))
    assert found == []
    begun.unlink()
    assert len(list(in_cluster(workers, answer, "abc", never))) == 3


def test_workers_of_another_version_are_refused(workers, monkeypatch):
    assert workers.compare() == []
    own = sharing.__version__
    monkeypatch.setattr(sharing, "__version__", "0.0.1")  # a worker that comes later
    with pytest.raises(ValueError, match=f"{socket.gethostname()} has valve_friction_ros {own}"):
        list(in_cluster(workers, answer, "a", never))
    with pytest.raises(ValueError, match=rf"tcp://\S+ has valve_friction_ros {own}\)"):
        workers.compare()


def test_other_versions_of_libraries_are_noted(workers, monkeypatch):
    theirs = sharing.versions()["numpy"]
    monkeypatch.setattr(sharing.metadata, "version", lambda _: "1.0")
    notes = workers.compare()
    assert (
        f"workers have numpy {theirs}, and this machine has 1.0: the last digits of results may "
        "differ" in notes
    )


def test_the_last_worker_goes(monkeypatch):
    monkeypatch.setattr(sharing, "NO_WORKER", 0.5)
    with local_cluster(workers=0) as empty, cluster_at(empty.scheduler_address) as found:
        with pytest.raises(
            ValueError, match=r"no worker has joined within 0\.5 s: start one with `dask"
        ):
            found.compare()
        with pytest.raises(ValueError, match="no worker has joined"):
            list(in_cluster(found, answer, "a", never))


def test_the_scheduler_goes(tmp_path):
    begun = tmp_path / "begun"
    with local_cluster() as passing, cluster_at(passing.scheduler_address) as found:
        found.compare()
        closing = threading.Thread(target=passing.close)

        def stopped():
            if begun.exists() and not closing.ident:
                closing.start()
            return False

        with pytest.raises(
            ValueError, match="the scheduler has disappeared: once it is back, run the"
        ):
            list(in_cluster(found, answer, [f"wait {begun}", *"abc"], stopped))
        closing.join()


def test_no_scheduler(monkeypatch):
    monkeypatch.setattr(sharing, "_AWAY", 0.5)
    for address in ("tcp://127.0.0.1:9", "nowhere", "odd://127.0.0.1:9"):
        with (
            pytest.raises(ValueError, match=f"^{address}: no scheduler answers: [^\n]*$"),
            cluster_at(address),
        ):
            pass
