"""Environment of child processes that import `sandbox`, `tests` or `tools` from these sources."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def with_root_on_path(**more: str) -> dict[str, str]:
    """Return this environment with the root of the repository first on PYTHONPATH, and `more` variables."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return {**os.environ, "PYTHONPATH": path, **more}
