"""Kernel: a plain function over arrays and floats, compiled by numba where the `fast` extra is installed.

    @kernel
    def advance(position, velocity, h): ...

With and without numba the answers are the same, bit for bit: no fast-math, no fused multiply-add, and kernels use
only operations that IEEE 754 rounds correctly (+ − × ÷ √), or the C library's own functions.

Compiled code is kept on disk, in a folder of its own for each state of these sources: numba itself would go on using
what it compiled of a function whose callee in another file has changed since.
"""

import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from sandbox.engines.compiling import COMPILING, say

P = ParamSpec("P")
R = TypeVar("R")

try:
    import numba
    from numba.core import event

    COMPILED = not getattr(numba.config, "DISABLE_JIT", 0)
except ImportError:
    COMPILED = False
"""Whether kernels are compiled. NUMBA_DISABLE_JIT=1 in the environment runs them as plain Python."""

UNUSED = 3600.0
"""s after which compiled code of a former state of the sources is thrown away."""

LARGE = 100
"""Bodies from which on it is worth saying that kernels run uncompiled."""


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function compiled at its first call, or as it is where numba is not installed."""
    return _compiled(function, {}) if COMPILED else function


def bare_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function compiled as `kernel` does, which may read and write arrays but make none.

    References to the arrays it is handed are not counted: that is an atomic operation for each array at each call,
    and took half the time of kernels as short as those of events. They let other threads run meanwhile.
    """
    # numba's own name for "no run-time support"; it has no public one.
    return _compiled(function, {"_nrt": False, "nogil": True}) if COMPILED else function


def _compiled(function: Callable[P, R], options: dict[str, bool]) -> Callable[P, R]:
    config: Any = numba.config
    theirs, folder = config.CACHE_DIR, cache_folder()
    config.CACHE_DIR = str(folder) if folder is not None else theirs
    try:
        compiled: Any = numba.njit(cache=folder is not None, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = theirs
    compiled.targetoptions.update(options)  # compiling waits for the first call, so this is in time
    return cast("Callable[P, R]", compiled)


@cache
def cache_folder() -> Path | None:
    """Return the folder for compiled code of just these sources, or None where none can be written.

    Folders of former states of the sources are removed, an hour on: until then a process may be at work in them.
    """
    here = Path(__file__).resolve().parent
    # Installations may share the user's folder, and Pythons the sources: each has folders of its own.
    place = blake2b(f"{here} {sys.version} {numba.__version__}".encode(), digest_size=4).hexdigest()
    stamp = blake2b(digest_size=8)
    for file in sorted(_sources(here)):
        status = file.stat()
        stamp.update(f"{file.name} {status.st_mtime_ns} {status.st_size}".encode())
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    for home in (here / "__pycache__", user / "sandbox2d"):
        folder = home / f"kernels-{place}-{stamp.hexdigest()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not os.access(folder, os.W_OK):
                continue
        except OSError:
            continue
        for old in home.glob(f"kernels-{place}-*"):
            if old != folder and _unused(old):
                shutil.rmtree(old, ignore_errors=True)  # another process may be removing it too
        return folder
    return None


def _sources(folder: Path) -> Iterator[Path]:
    """Yield the sources below a folder; what is compiled lies there too, and another process may be removing it."""
    for place, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if name != "__pycache__"]
        yield from (Path(place, name) for name in files if name.endswith(".py"))


def _unused(folder: Path) -> bool:
    """Tell whether a folder is so old that no process can still be compiling into it."""
    try:
        return time.time() - folder.stat().st_mtime > UNUSED
    except OSError:  # gone already
        return False


def tell_if_slow(bodies: int) -> None:
    """Say so where a large scene runs on kernels that are not compiled."""
    if not COMPILED and bodies >= LARGE:
        say(f"{bodies:,} bodies without compiled kernels will be slow: pip install -e '.[fast]'")


if COMPILED:

    class _Listener(event.Listener):
        """Tells of what numba compiles."""

        def on_start(self, event: Any) -> None:
            COMPILING.begin(getattr(event.data.get("dispatcher"), "__module__", ""))

        def on_end(self, event: Any) -> None:  # noqa: ARG002, numba's signature
            COMPILING.end()

    event.register("numba:compile", _Listener())  # type: ignore[no-untyped-call]  # numba's own
