"""Versions: what a figure was measured with."""

import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


@cache
def versions() -> dict[str, str]:
    """Return the versions that a run's numbers depend on."""
    found = {"python": platform.python_version()}
    for package in ("sandbox2d", "pymunk", "numpy", "numba"):
        try:
            found["sandbox" if package == "sandbox2d" else package] = version(package)
        except PackageNotFoundError:
            continue
    return found


@cache
def machine() -> dict[str, str | int]:
    """Return what is worth knowing of the machine."""
    return {
        "cpu": _processor(),
        "cores": os.cpu_count() or 1,
        "machine": platform.machine(),
        "system": platform.platform(),
    }


def _processor() -> str:
    """Return the processor's model: Linux tells it in a file, other systems tell Python; else the architecture."""
    try:
        with Path("/proc/cpuinfo").open(encoding="utf-8", errors="replace") as lines:
            named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    except OSError:
        named = []
    return named[0] if named and named[0] else platform.processor() or platform.machine()
