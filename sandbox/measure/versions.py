"""Versions: what a figure was measured with."""

import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version


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


def machine() -> dict[str, str | int]:
    """Return what is worth knowing of the machine."""
    return {"system": platform.platform(), "machine": platform.machine(), "cores": os.cpu_count() or 1}
