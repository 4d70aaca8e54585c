"""Runs on a Dask cluster: a scheduler and two workers as separate processes on loopback."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic, sleep

import distributed
import pytest

from sandbox.batch.store import Store
from sandbox.cli.main import call
from tests.batch.test_resume import SCENE, assert_equal_stores, stored
from tests.cli.calling import json_of
from tests.environment import with_root_on_path

pytestmark = pytest.mark.nightly

PRELOAD = """
import os, signal, time
from sandbox.batch import executors
from sandbox.batch.job import run_job
def run(job, *more):
    if job.scene.world.seed == 7:
        {action}
    return run_job(job, *more)
executors.run_job = run
"""
"""Code that a worker runs at its start, for a run that does it harm"""


OTHER_IF_FIRST = """
import multiprocessing
from pathlib import Path
from sandbox.batch import executors
if multiprocessing.parent_process() is not None and not Path("{first}").exists():  # not in its nanny
    Path("{first}").mkdir()
    executors.versions = lambda: {{'python': '2.7'}}
"""
"""Code that gives the first worker that runs it other versions"""


class Cluster:
    """A scheduler and its workers."""

    def __init__(self, folder: Path, scheduler: subprocess.Popen[bytes]) -> None:
        self.folder, self.scheduler = folder, scheduler
        self.workers: list[subprocess.Popen[bytes]] = []
        self.start_worker: Callable[[], subprocess.Popen[bytes]]
        self.file = folder / "scheduler.json"
        wait_until(self.file.exists)
        wait_until(lambda: self.file.read_text() != "")
        self.address = str(json.loads(self.file.read_text())["address"])


@contextmanager
def cluster(folder: Path, preload: str = "", workers: int = 2) -> Iterator[Cluster]:
    """Start a scheduler and workers of one thread each, and kill them at the end."""
    folder.mkdir()
    with ExitStack() as stack, (folder / "log").open("wb") as log:

        def start(*words: str) -> subprocess.Popen[bytes]:
            command = [sys.executable, "-W", "ignore", "-m", "dask", *words]
            process = subprocess.Popen(
                command, stdout=log, stderr=log, cwd=folder, env=with_root_on_path(), start_new_session=True
            )
            stack.callback(end, process)
            return process

        file = str(folder / "scheduler.json")
        found = Cluster(
            folder,
            start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", file, "--no-dashboard"),
        )
        options = ["--nthreads", "1", "--no-dashboard", "--local-directory", str(folder)]
        if preload:
            (folder / "harm.py").write_text(preload)
            options += ["--preload", str(folder / "harm.py")]
        found.start_worker = lambda: start("worker", found.address, *options)
        for _ in range(workers):
            found.workers.append(found.start_worker())
        with distributed.Client(found.address, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=60)
        yield found


def end(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and those that it has started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
    finally:
        process.wait()


def wait_until(condition: object) -> None:
    until = monotonic() + 60.0
    assert callable(condition)
    while not condition():
        assert monotonic() < until
        sleep(0.05)


@pytest.fixture
def scene(tmp_path: Path) -> str:
    path = tmp_path / "sparks.toml"
    path.write_text(SCENE)
    return str(path)


def test_runs_on_a_cluster_are_equal_bit_for_bit_to_runs_in_this_process(scene: str, tmp_path: Path) -> None:
    words = ["run", scene, "--seeds", "20", "--engines", "pymunk,reference", "--quiet"]
    assert call([*words, "--out", str(tmp_path / "here")]) == 0
    with cluster(tmp_path / "cluster") as found:
        assert call([*words, "--out", str(tmp_path / "there"), "--on", found.address]) == 0
        assert call([*words, "--out", str(tmp_path / "by-file"), "--on", str(found.file)]) == 0
    assert_equal_stores(tmp_path / "here", tmp_path / "there")
    assert_equal_stores(tmp_path / "here", tmp_path / "by-file")


def drive(scene: str, folder: Path, found: Cluster, *more: str) -> subprocess.Popen[str]:
    words = ["run", scene, "--seeds", "300", "--out", str(folder), "--on", found.address, "--quiet", *more]
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [sys.executable, "-m", "sandbox", *words], stdout=pipe, stderr=pipe, text=True, env=with_root_on_path()
    )


def test_worker_of_a_cluster_killed_by_pid_loses_and_doubles_no_run(scene: str, tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with cluster(tmp_path / "cluster") as found, drive(scene, folder, found) as driver:
        wait_until(lambda: len(stored(folder)) >= 30)
        end(found.workers[0])  # with its nanny, so that it is not restarted
        _, err = driver.communicate(timeout=120)
        assert (driver.returncode, err) == (0, "")
    assert sorted(seed for _, seed, _ in stored(folder)) == list(range(1, 301))


def test_lost_scheduler_ends_the_command_which_can_be_resumed(scene: str, tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with cluster(tmp_path / "cluster") as found, drive(scene, folder, found) as driver:
        wait_until(lambda: len(stored(folder)) >= 30)
        end(found.scheduler)
        _, err = driver.communicate(timeout=120)
        (message,) = err.splitlines()
        assert driver.returncode == 1
        assert message.startswith(f"--on: the scheduler at {found.address} is lost; give the same command again")
    before = stored(folder)
    assert 30 <= len(before) < 300
    with cluster(tmp_path / "again") as found, drive(scene, folder, found) as driver:
        _, err = driver.communicate(timeout=120)
        assert (driver.returncode, err) == (0, "")
    after = stored(folder)
    assert after[: len(before)] == before
    assert sorted(seed for _, seed, _ in after) == list(range(1, 301))


def test_run_that_kills_its_workers_is_recorded_as_failed(scene: str, tmp_path: Path) -> None:
    harm = PRELOAD.format(action="os.kill(os.getpid(), signal.SIGKILL)")
    folder = tmp_path / "runs"
    with cluster(tmp_path / "cluster", harm) as found, drive(scene, folder, found) as driver:
        _, err = driver.communicate(timeout=240)
        assert driver.returncode == 1
        assert err.splitlines() == [f"{scene}: failed: the workers that ran it died"]
    with Store(folder) as store:
        assert [row.seed for row in store.rows() if row.status != "ok"] == [7]
        assert len(store.rows()) == 300


def test_run_that_exceeds_its_time_on_a_cluster_is_recorded_as_failed(scene: str, tmp_path: Path) -> None:
    harm = PRELOAD.format(action="job = __import__('dataclasses').replace(job, scene=long(job.scene))")
    harm += """
def long(scene):
    return scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 1e5})})
"""
    folder = tmp_path / "runs"
    more = ("--time-limit", "2", "--set", "solver.record_every=1000000")
    with cluster(tmp_path / "cluster", harm) as found, drive(scene, folder, found, *more) as driver:
        _, err = driver.communicate(timeout=240)
        assert driver.returncode == 1
        assert err.splitlines() == [f"{scene}: failed: stopped at the time limit of 2 s"]
    assert len(stored(folder)) == 300


SSHD = """
Port {port}
ListenAddress 127.0.0.1
HostKey {folder}/host
AuthorizedKeysFile {folder}/user.pub
StrictModes no
PasswordAuthentication no
UsePAM no
PermitRootLogin yes
PidFile none
"""


@pytest.mark.skipif(shutil.which("sshd") is None, reason="needs an SSH server")
def test_cluster_that_was_started_by_ssh_runs_a_sweep(scene: str, tmp_path: Path) -> None:
    """`dask ssh` starts the scheduler and two workers through an SSH server on loopback."""
    folder, ports = tmp_path / "ssh", free_ports(2)
    folder.mkdir()
    for name, kind in (("host", "ed25519"), ("user", "rsa")):
        key = ["ssh-keygen", "-q", "-t", kind, "-m", "PEM", "-N", "", "-f", str(folder / name)]
        subprocess.run(key, check=True)
    (folder / "config").write_text(SSHD.format(port=ports[0], folder=folder))
    if os.getuid() == 0:
        Path("/run/sshd").mkdir(exist_ok=True)  # the server changes its root to it
    with ExitStack() as stack, (folder / "log").open("wb") as log:

        def start(*command: str) -> None:
            started = subprocess.Popen(
                command, stdout=log, stderr=log, cwd=folder, env=with_root_on_path(), start_new_session=True
            )
            stack.callback(end, started)

        server = shutil.which("sshd")
        assert server is not None
        start(server, "-D", "-e", "-f", str(folder / "config"))
        wait_until(lambda: "Server listening" in (folder / "log").read_text(errors="replace"))
        options = ["--ssh-port", str(ports[0]), "--ssh-private-key", str(folder / "user"), "--nworkers", "2"]
        options += ["--nthreads", "1", "--scheduler-port", str(ports[1]), "--remote-python", sys.executable]
        options += ["--local-directory", str(folder)]
        start(sys.executable, "-W", "ignore", "-m", "dask", "ssh", *options, "127.0.0.1")
        wait_until(lambda: (folder / "log").read_text(errors="replace").count("Registered to:") >= 2)
        words = ["run", scene, "--seeds", "20", "--quiet"]
        assert call([*words, "--out", str(tmp_path / "there"), "--on", f"tcp://127.0.0.1:{ports[1]}"]) == 0
        assert call([*words, "--out", str(tmp_path / "here")]) == 0
    assert_equal_stores(tmp_path / "here", tmp_path / "there")


def free_ports(count: int) -> list[int]:
    """Return ports of loopback that no server listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [int(each.getsockname()[1]) for each in sockets]


def test_worker_with_other_versions_is_refused(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    other = "from sandbox.batch import executors\nexecutors.versions = lambda: {'python': '2.7'}\n"
    with cluster(tmp_path / "cluster", other, workers=1) as found:
        status, document, err = json_of(capfd, "run", scene, "--on", found.address)
    assert (status, document["runs"]) == (1, [])
    assert "--on: a worker has other versions" in err[-1]
    assert "python 2.7 instead of 3." in err[-1]


def test_workers_with_other_versions_are_left_out(scene: str, tmp_path: Path) -> None:
    with cluster(tmp_path / "cluster", OTHER_IF_FIRST.format(first=tmp_path / "first")) as found:
        with drive(scene, tmp_path / "runs", found) as driver:
            wait_until(lambda: len(stored(tmp_path / "runs")) >= 30)
            joined = found.start_worker()  # others may join in the middle
            _, err = driver.communicate(timeout=240)
        assert driver.returncode == 0
        assert joined.poll() is None
    lines = err.splitlines()
    assert len(lines) == 1
    assert re.fullmatch(
        r"worker tcp://\S+ is left out, as its runs would differ: .*python 2.7 instead of 3.*", lines[0]
    )
    assert sorted(seed for _, seed, _ in stored(tmp_path / "runs")) == list(range(1, 301))


def test_address_without_a_scheduler_is_an_error(
    scene: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.batch.cluster.CONNECT_TIME", 1.0)
    for address, message in (
        ("tcp://127.0.0.1:1", "tcp://127.0.0.1:1: no Dask scheduler answers: "),
        ("nonsense://x", "'nonsense://x' is no scheduler: give its address"),
        ("no-such-file.json", "'no-such-file.json' is no scheduler"),
    ):
        status, document, err = json_of(capfd, "run", scene, "--on", address)
        assert (status, document["runs"]) == (1, [])
        assert len(err) == 1
        assert err[0].startswith(f"--on: {message}")
