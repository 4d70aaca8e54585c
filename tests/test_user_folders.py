"""Folders of the user: environment variables, users without a home folder, shared temporary folders."""

import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sandbox.user_folders import cache_folders, data_folder, home_folder

SOURCES = Path(__file__).resolve().parents[1]


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[pytest.MonkeyPatch]:
    """No variable is set, and the user has no entry in the list of users; temporary files are in `tmp`."""
    for name in ("HOME", "SANDBOX_DATA", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def unknown(user: int) -> None:
        raise KeyError(user)

    monkeypatch.setattr("pwd.getpwuid", unknown)
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    yield monkeypatch


def test_data_folder_is_the_configured_one_or_that_of_the_user(environment: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="SANDBOX_DATA"):
        data_folder()
    environment.setenv("HOME", str(tmp_path))
    assert data_folder() == tmp_path / ".local" / "share" / "sandbox"
    environment.setenv("XDG_DATA_HOME", "not/absolute")
    assert data_folder() == tmp_path / ".local" / "share" / "sandbox"
    environment.setenv("XDG_DATA_HOME", str(tmp_path / "xdg"))
    assert data_folder() == tmp_path / "xdg" / "sandbox"
    environment.setenv("SANDBOX_DATA", str(tmp_path / "own"))
    assert data_folder() == tmp_path / "own"


def test_caches_of_a_user_without_a_home_folder_are_temporary_and_private(
    environment: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert home_folder() is None
    (folder,) = cache_folders()
    assert folder.parent == tmp_path / "tmp"
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert list(cache_folders()) == [folder]  # it is there already
    environment.setenv("HOME", str(tmp_path))
    assert list(cache_folders()) == [tmp_path / ".cache" / "sandbox2d", folder]
    environment.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert list(cache_folders()) == [tmp_path / "xdg" / "sandbox2d", folder]
    environment.setenv("XDG_CACHE_HOME", "not/absolute")
    assert list(cache_folders()) == [tmp_path / ".cache" / "sandbox2d", folder]


@pytest.mark.parametrize("prepared", ["file", "link", "writable by others", "another owner"])
def test_a_prepared_temporary_folder_is_not_used(
    environment: pytest.MonkeyPatch, tmp_path: Path, prepared: str
) -> None:
    """Compiled code in it would be executed."""
    folder = tmp_path / "tmp" / f"sandbox2d-{os.getuid()}"
    if prepared == "file":
        folder.write_text("")
    elif prepared == "link":
        (tmp_path / "elsewhere").mkdir()
        folder.symlink_to(tmp_path / "elsewhere")
    else:
        folder.mkdir()
        folder.chmod(0o777 if prepared == "writable by others" else 0o700)
        if prepared == "another owner":
            other = os.getuid() + 1
            environment.setattr(os, "getuid", lambda: other)
            folder.rename(folder.with_name(f"sandbox2d-{other}"))
    assert list(cache_folders()) == []


WITHOUT_A_USER = """
import pwd

def unknown(user):
    raise KeyError(user)

pwd.getpwuid = unknown
"""
PLOT = """
from sandbox.cli.main import main
main(["run", "tutorial/bounce", "--plot", "a.png"])
"""
ONE_KERNEL = """
from sandbox.engines.reference.manifold import circle_circle
circle_circle(0.0, 0.0, 1.0, 3.0, 4.0, 1.0)
"""


@pytest.mark.fail_slow(60)  # child processes, which compile a kernel
@pytest.mark.parametrize("code", [PLOT, ONE_KERNEL])
@pytest.mark.parametrize("home", [None, "/proc/nonexistent", "relative"])
def test_commands_work_for_a_user_without_a_home_folder(tmp_path: Path, code: str, home: str | None) -> None:
    """The package cannot be written to, as in a container that runs under an arbitrary user ID."""
    site, work, temporary = tmp_path / "site", tmp_path / "work", tmp_path / "tmp"
    shutil.copytree(SOURCES / "sandbox", site / "sandbox", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(SOURCES / "scenes", site / "sandbox" / "shipped")
    (site / "sandbox" / "engines" / "__pycache__").write_text("")  # a file, so that not even root can write there
    work.mkdir()
    temporary.mkdir()
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(site), "TMPDIR": str(temporary)}
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_A_USER + code],
        capture_output=True,
        text=True,
        cwd=work,
        env=environment if home is None else {**environment, "HOME": home},
        timeout=120,
        check=False,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    if code == PLOT:
        assert (work / "a.png").stat().st_size > 1000
    elif home != "relative":
        assert list(temporary.glob("sandbox2d-*/kernels-*"))
