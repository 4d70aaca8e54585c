"""Folders of the user: caches and data. A user of a container may have no home folder, or one that is not writable."""

import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

DATA = "SANDBOX_DATA"
"""Environment variable with the data folder; default: that of the platform."""


def home_folder() -> Path | None:
    """Return the home folder of the user, which may not exist; None if the user has none."""
    try:
        return Path.home()
    except RuntimeError:  # neither HOME nor an entry in the list of users
        return None


def data_folder() -> Path:
    """Return the data folder of the user: `SANDBOX_DATA`, or that of the platform. It may not exist yet.

    Raises:
        FileNotFoundError: the variable is not set, and the user has no home folder.
    """
    configured = os.environ.get(DATA)
    if configured:
        return Path(configured)
    platform = Path(os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_DATA_HOME", ""))
    # Source: XDG Base Directory Specification, 0.8: $XDG_DATA_HOME, else ~/.local/share; a relative path is ignored.
    if platform.is_absolute():
        return platform / "sandbox"
    home = home_folder()
    if home is None:
        raise FileNotFoundError(f"this user has no home folder; set {DATA} to a folder")
    return home / ("AppData/Local" if os.name == "nt" else ".local/share") / "sandbox"


def cache_folders() -> Iterator[Path]:
    """Yield the folders for caches of this package, best first; they may not exist, or not be writable.

    The last one is temporary: it holds the cache of a user without a home folder until the machine restarts.
    """
    configured = Path(os.environ.get("XDG_CACHE_HOME", ""))
    home = home_folder()
    if configured.is_absolute():
        yield configured / "sandbox2d"
    elif home is not None:
        yield home / ".cache" / "sandbox2d"
    temporary = _private_temporary_folder()
    if temporary is not None:
        yield temporary


def _private_temporary_folder() -> Path | None:
    """Create the user's own folder in the shared temporary one; None if others own it or could write into it.

    Compiled code is executed: a folder that another user has prepared under this name must not be used.
    """
    user = os.getuid() if hasattr(os, "getuid") else None
    try:
        folder = Path(tempfile.gettempdir()) / ("sandbox2d" if user is None else f"sandbox2d-{user}")
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:  # there is no temporary folder, or a file has this name
        return None
    if user is None:
        return folder  # on Windows each user has a temporary folder
    is_private = stat.S_ISDIR(status.st_mode) and status.st_uid == user and not status.st_mode & 0o022
    return folder if is_private else None
