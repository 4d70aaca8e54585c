"""`sandbox serve`: its address, its end, and faults of its options."""

import signal
import subprocess
from urllib.request import urlopen

import pytest

from tests.cli.calling import lines_of, write_scene
from tests.interruptible import interruptible

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


def test_serve_prints_its_address_and_ends_with_ctrl_c(tmp_path) -> None:
    command = interruptible("serve", write_scene(tmp_path), "--slider", "solver.dt=0.001:0.1")
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        with urlopen(address, timeout=30) as response:
            assert b"<h1>" in response.read()
        server.send_signal(signal.SIGINT)
        out, err = server.communicate(timeout=60)
    assert (server.returncode, out, err.splitlines()[-1]) == (130, "", "interrupted")


@pytest.mark.parametrize(
    ("options", "status", "words"),
    [
        (["--engine", "zzz"], 2, "zzz"),
        (["--set", "ball.zzz.radius=1"], 2, "zzz"),
        (["--slider", "ball.zzz.radius"], 2, "--slider"),
        (["--port", "99999"], 2, "99999"),
        (["--host", "203.0.113.7", "--port", "1"], 2, "203.0.113.7"),
        (["--host", ""], 2, "--host"),
    ],
)
def test_faults_of_options_are_reported(options, status, words, tmp_path, capfd) -> None:
    found, out, err = lines_of(capfd, "serve", write_scene(tmp_path), *options)
    assert (found, out) == (status, [])
    assert words in err[-1]
