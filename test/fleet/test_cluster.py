"""Work shared out to the workers of a Dask cluster."""

import socket
import threading

import pytest
from dask_workers import answer, local_cluster

from valve_friction_ros.fleet import DeadWorker, cluster_at, in_cluster
from valve_friction_ros.fleet.sharing import batches, cluster, remote_calls

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


def never():
    return False


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
    assert "the process of its worker died 1 times, last that of tcp://" in str(dead["kill"])
    assert str(dead["raise"]) == "unexpected RuntimeError of its worker: of two lines"


def test_what_is_handed_out_is_bounded(workers, monkeypatch):
    sizes, kept = [], batches._Run._hand_out

    def hand_out(run, tasks, is_alone=False):
        kept(run, tasks, is_alone)
        sizes.append((len(tasks), len(run._out)))

    monkeypatch.setattr(batches._Run, "_hand_out", hand_out)
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
    own = remote_calls.__version__
    monkeypatch.setattr(batches, "__version__", "0.0.1")  # a worker that comes later
    with pytest.raises(ValueError, match=f"{socket.gethostname()} has valve_friction_ros {own}"):
        list(in_cluster(workers, answer, "a", never))
    monkeypatch.setattr(remote_calls, "__version__", "0.0.1")
    with pytest.raises(ValueError, match=rf"tcp://\S+ has valve_friction_ros {own}\)"):
        workers.compare()


def test_other_versions_of_libraries_are_noted(workers, monkeypatch):
    theirs = remote_calls.versions()["numpy"]
    monkeypatch.setattr(remote_calls.metadata, "version", lambda _: "1.0")
    notes = workers.compare()
    assert (
        f"workers have numpy {theirs}, and this machine has 1.0: the last digits of results may "
        "differ" in notes
    )


def test_the_last_worker_goes(monkeypatch):
    monkeypatch.setattr(batches, "NO_WORKER", 0.5)
    monkeypatch.setattr(cluster, "NO_WORKER", 0.5)
    with local_cluster(workers=0) as empty, cluster_at(empty.scheduler_address) as found:
        with pytest.raises(ValueError, match=r"no worker has come in 0\.5 s: start some by `dask"):
            found.compare()
        with pytest.raises(ValueError, match="no worker has come"):
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

        with pytest.raises(ValueError, match="the scheduler has gone: once it is back, the same"):
            list(in_cluster(found, answer, [f"wait {begun}", *"abc"], stopped))
        closing.join()


def test_no_scheduler(monkeypatch):
    monkeypatch.setattr(cluster, "_AWAY", 0.5)
    for address in ("tcp://127.0.0.1:9", "nowhere", "odd://127.0.0.1:9"):
        with (
            pytest.raises(ValueError, match=f"^{address}: no scheduler answers: [^\n]*$"),
            cluster_at(address),
        ):
            pass
