"""Files of levels, as text of a limited size, and the errors that refuse them."""

from pathlib import Path
from typing import NoReturn

from sandbox.resource_limits import FILE_SIZE, ResourceLimit, read_limited
from sandbox.scene.errors import Fault, SceneError


def refuse(file: str, message: str, line: int | None = None, path: str = "") -> NoReturn:
    """Raise a `SceneError` with one fault."""
    raise SceneError([Fault(file, line, path, message)])


def read_text(path: Path, file: str, max_size: ResourceLimit = FILE_SIZE) -> str:
    """Return the text of a file.

    Args:
        path: path of the file.
        file: its name in faults.
        max_size: its largest size.

    Raises:
        SceneError: it cannot be read, is too large, compressed, or no UTF-8 text.
    """
    try:
        content = read_limited(path, max_size.value)
    except OSError as error:
        refuse(file, f"cannot be read: {error.strerror or error}")
    except ValueError:
        refuse(file, f"is too large: {max_size.remedy(2 * max_size.value)}")
    if content[:2] == b"\x1f\x8b":
        refuse(file, "is compressed; save it as plain text: .svg instead of .svgz, .tmx instead of .tmx.gz")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        refuse(file, "is not UTF-8 text; save it as UTF-8", line)
