"""Kernels: plain functions over arrays and floats, compiled by numba where the `fast` extra is installed.

    @kernel
    def advance(position, velocity, h): ...

Results with and without numba are equal, bit for bit: no fast-math, no fused multiply-add, and kernels use only
operations that IEEE 754 rounds correctly (+ − × ÷ √) or functions of the C library.

Compiled code is cached on disk in one folder for each state of these sources: numba itself does not notice when a
callee in another file has changed.
"""

import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from sandbox.engines.common.compile_clock import COMPILE_CLOCK, say
from sandbox.user_folders import cache_folders

P = ParamSpec("P")
R = TypeVar("R")

try:
    import numba
    from numba.core import event
    from numba.core.caching import FunctionCache

    COMPILED = not getattr(numba.config, "DISABLE_JIT", 0)
except ImportError:
    COMPILED = False
"""Whether kernels are compiled. NUMBA_DISABLE_JIT=1 in the environment runs them as plain Python."""

MAX_IDLE_AGE = 3600.0
"""s, age from which on compiled code of an earlier state of the sources is deleted"""

SLOW_FROM = 100
"""Number of bodies from which on a notice about uncompiled kernels is printed."""


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that is compiled at its first call, or the function itself if numba is not installed."""
    return _compiled(function, {}) if COMPILED else function


def bare_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function compiled as by `kernel`, which may read and write arrays but not create any.

    Its array arguments are not reference-counted: counting is an atomic operation for each array at each call, and took
    half the time of short kernels such as those of events. These kernels release the GIL.
    """
    # numba's internal name for "no run-time support"; there is no public one.
    return _compiled(function, {"_nrt": False, "nogil": True}) if COMPILED else function


def inline_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function compiled as by `bare_kernel` that is always expanded in the kernels that call it.

    For functions with a tuple of many arrays as argument, of which a call copies a hundred words: that took half the
    time of an event. Each further call in a kernel makes its code longer.
    """
    return _compiled(function, {"_nrt": False, "nogil": True, "forceinline": True}) if COMPILED else function


class OptionalKernel:
    """Decides whether a kernel is worth its compilation that only saves time: without it, results are the same.

    It is, if its compiled code is in memory or on disk, or once the time spent without it exceeds the time to compile
    it. So a first short run does not wait, and a long session does not stay slow.
    """

    def __init__(self, function: Callable[..., object], compile_time: float) -> None:
        """Watch a kernel that takes `compile_time`, s, to compile."""
        self._function, self._compile_time = function, compile_time
        self.spent = 0.0
        """s, time spent without the kernel"""
        self._is_ready = False

    @property
    def is_worthwhile(self) -> bool:
        """Whether to use the kernel."""
        if COMPILED and not self._is_ready:
            dispatcher: Any = self._function
            self._is_ready = self.spent > self._compile_time or bool(dispatcher.signatures) or _is_on_disk(dispatcher)
        return self._is_ready


def _is_on_disk(dispatcher: Any) -> bool:
    """Return whether there is compiled code of a kernel in the cache."""
    # numba has no public way to ask. Without a writable folder there is no cache file.
    cache_file = getattr(dispatcher._cache, "_cache_file", None)
    return cache_file is not None and Path(cache_file._index_path).is_file()


_CACHE_DIR_LOCK = threading.Lock()
"""Held while numba's global CACHE_DIR is changed: threads may import modules with kernels at the same time, and a cache
that reads the folder of another thread's restoration would lie in the working directory."""


def _compiled(function: Callable[P, R], options: dict[str, bool]) -> Callable[P, R]:
    config: Any = numba.config
    with _CACHE_DIR_LOCK:
        numba_folder, folder = config.CACHE_DIR, cache_folder()
        config.CACHE_DIR = str(folder) if folder is not None else numba_folder
        try:
            compiled: Any = numba.njit(error_model="numpy")(function)
            if folder is not None:
                cache_class: Any = _KernelCache
                compiled._cache = cache_class(function)  # as `cache=True` does, with numba's class
        finally:
            config.CACHE_DIR = numba_folder
    compiled.targetoptions.update(options)  # takes effect, because compiling waits for the first call
    return cast("Callable[P, R]", compiled)


@cache
def cache_folder() -> Path | None:
    """Return the folder for compiled code of exactly these sources; None if no folder is writable.

    Folders of earlier states of the sources are deleted after an hour: until then another process may use them.
    """
    engines = Path(__file__).resolve().parents[1]
    # Installations may share the user's folder, and Python versions the sources: each has its own folders.
    installation = blake2b(f"{engines} {sys.version} {numba.__version__}".encode(), digest_size=4).hexdigest()
    stamp = blake2b(digest_size=8)
    geometry = engines.parent / "scene" / "geometry"  # kernels compile functions of it
    for file in sorted((*_sources(engines), *_sources(geometry))):
        status = file.stat()
        stamp.update(f"{file.name} {status.st_mtime_ns} {status.st_size}".encode())
    for parent in (engines / "__pycache__", *cache_folders()):
        folder = parent / f"kernels-{installation}-{stamp.hexdigest()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not os.access(folder, os.W_OK):
                continue
        except OSError:
            continue
        for other in parent.glob(f"kernels-{installation}-*"):
            if other != folder and _is_unused(other):
                shutil.rmtree(other, ignore_errors=True)  # another process may be removing it too
        return folder
    return None


def _sources(folder: Path) -> Iterator[Path]:
    """Yield the source files below a folder. `__pycache__` is skipped: another process may be deleting files there."""
    for path, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if name != "__pycache__"]
        yield from (Path(path, name) for name in files if name.endswith(".py"))


def _is_unused(folder: Path) -> bool:
    """Return whether a folder is so old that no process can still be compiling into it."""
    try:
        return time.time() - folder.stat().st_mtime > MAX_IDLE_AGE
    except OSError:  # deleted meanwhile
        return False


def warn_if_uncompiled(bodies: int) -> None:
    """Print a notice if a large scene runs on uncompiled kernels."""
    if not COMPILED and bodies >= SLOW_FROM:
        say(f"{bodies:,} bodies are slow without compiled kernels; install them with: pip install -e '.[fast]'")


if COMPILED:

    class _KernelCache(FunctionCache):
        """Compiled code on disk. If it cannot be saved, as on a full disk, the next process compiles again."""

        def save_overload(self, sig: Any, data: Any) -> None:
            try:
                super().save_overload(sig, data)  # type: ignore[no-untyped-call]  # of numba
            except OSError as error:
                say(f"compiled code cannot be cached in {cache_folder()}: {error.strerror or error}")

    class _Listener(event.Listener):
        """Reports to the compile clock when numba compiles."""

        def on_start(self, event: Any) -> None:
            COMPILE_CLOCK.begin(getattr(event.data.get("dispatcher"), "__module__", ""))

        def on_end(self, event: Any) -> None:  # noqa: ARG002, numba's signature
            COMPILE_CLOCK.end()

    event.register("numba:compile", _Listener())  # type: ignore[no-untyped-call]  # numba's own
