"""Versions: what a figure was measured with."""

import hashlib
import os
import platform
from collections.abc import Iterator, Set
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGE = Path(__file__).parent
DISPLAY = ("cli", "window", "report")
"""Subpackages that show results and do not change them: no digest has them."""
READERS = (
    "levels",
    "pymunk_capture",
    "pymunk_export",
    "measure/advice",
    "measure/analytic",
    "measure/compare",
    "measure/extremes",
    "measure/preflight",
    "measure/tradeoff",
)
"""Folders that make scenes, or ask for runs and read them: the digest of a run leaves them out."""
ENGINE_FOLDERS = {
    "pymunk": "engines/pymunk_adapter",
    "box2d": "engines/box2d_adapter",
    "exact": "engines/exact",
    "reference": "engines/reference",
}
"""Folder of each engine. None imports from another, so the digest of a run has that of its own engine alone."""
LIBRARIES = {"pymunk": "pymunk", "box2d": "pyb2d3"}
"""Package that an engine adapts."""


@cache
def versions(engine: str | None = None) -> dict[str, str]:
    """Return the versions that a run's numbers depend on.

    That of the sandbox carries the digest of its sources, as in `0.1.0+src.1a2b3c4d`, so that an edited integrator is
    another version.

    Args:
        engine: name of an engine: only what computes a run on it. numba does not count, as the engines give the same
            results to the last bit without it. Default: everything, as for the reports of several engines.
    """
    libraries = ["pymunk", "pyb2d3", "numpy", "numba"]
    if engine is not None:
        libraries = [*([LIBRARIES[engine]] if engine in LIBRARIES else []), "numpy"]
    found = {"python": platform.python_version()}
    for package in ("sandbox2d", *libraries):
        try:
            found["sandbox" if package == "sandbox2d" else package] = version(package)
        except PackageNotFoundError:
            continue
    digest = source_digest(engine)
    if digest and "sandbox" in found:
        found["sandbox"] += f"+src.{digest}"
    return found


@cache
def source_digest(engine: str | None = None) -> str:
    """Return 8 hex digits of the names and contents of the sources that can change a run; "" if there are none.

    Every file counts but those that are known to change nothing, so a new module of physics counts without being
    listed. About 10 ms, once in a process.

    Args:
        engine: name of the engine of the run; default: the sources of all engines, and of what reads runs.
    """
    left_out = set(DISPLAY)
    if engine is not None:
        left_out |= {*READERS, *(folder for name, folder in ENGINE_FOLDERS.items() if name != engine)}
    names, hashed = sorted(_sources(left_out)), hashlib.sha256()
    for name in names:
        content = (PACKAGE / name).read_bytes()
        hashed.update(f"{name}\0{len(content)}\0".encode())
        hashed.update(content)
    return hashed.hexdigest()[:8] if names else ""


def _sources(left_out: Set[str]) -> Iterator[str]:
    """Yield the paths of the sources within the package, with `/` on every system, but those in some folders."""
    for folder, inner, files in os.walk(PACKAGE):
        where = os.path.relpath(folder, PACKAGE).replace(os.sep, "/")
        prefix = "" if where == "." else f"{where}/"
        inner[:] = [name for name in inner if name != "__pycache__" and f"{prefix}{name}" not in left_out]
        yield from (f"{prefix}{name}" for name in files if name.endswith(".py"))


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
