"""Versions: what a figure was measured with."""

import hashlib
import os
import platform
from collections.abc import Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGE = Path(__file__).parent
DISPLAY = ("cli", "window", "report")
"""Subpackages that show results and do not change them: the digest leaves them out."""


@cache
def versions() -> dict[str, str]:
    """Return the versions that a run's numbers depend on.

    That of the sandbox carries the digest of its sources, as in `0.1.0+src.1a2b3c4d`, so that an edited integrator is
    another version.
    """
    found = {"python": platform.python_version()}
    for package in ("sandbox2d", "pymunk", "pyb2d3", "numpy", "numba"):
        try:
            found["sandbox" if package == "sandbox2d" else package] = version(package)
        except PackageNotFoundError:
            continue
    digest = source_digest()
    if digest and "sandbox" in found:
        found["sandbox"] += f"+src.{digest}"
    return found


@cache
def source_digest() -> str:
    """Return 8 hex digits of the names and contents of all sources that can change a run; "" if there are none.

    Every file counts but those of `DISPLAY`, so a new module of physics counts without being listed. About 10 ms, once
    in a process.
    """
    names, hashed = sorted(_sources()), hashlib.sha256()
    for name in names:
        content = (PACKAGE / name).read_bytes()
        hashed.update(f"{name}\0{len(content)}\0".encode())
        hashed.update(content)
    return hashed.hexdigest()[:8] if names else ""


def _sources() -> Iterator[str]:
    """Yield the paths of the sources within the package, with `/` on every system."""
    for folder, inner, files in os.walk(PACKAGE):
        where = os.path.relpath(folder, PACKAGE).replace(os.sep, "/")
        if where == ".":
            inner[:] = [name for name in inner if name not in DISPLAY]
        inner[:] = [name for name in inner if name != "__pycache__"]
        yield from (name if where == "." else f"{where}/{name}" for name in files if name.endswith(".py"))


@cache
def machine() -> dict[str, str | int]:
    """Return the processor, its cores and the operating system."""
    return {
        "cpu": _processor(),
        "cores": os.cpu_count() or 1,
        "machine": platform.machine(),
        "system": platform.platform(),
    }


def _processor() -> str:
    """Return the processor's model, from a file on Linux and from Python elsewhere; else the architecture."""
    try:
        with Path("/proc/cpuinfo").open(encoding="utf-8", errors="replace") as lines:
            named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    except OSError:
        named = []
    return named[0] if named and named[0] else platform.processor() or platform.machine()
