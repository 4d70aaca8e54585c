"""Text in the system's clipboard."""

import sys

import pygame

TEXT_TYPE = "text/plain;charset=utf-8"
"""The only type of text that pygame exchanges with other programs on all systems; `pygame.SCRAP_TEXT` fails on X11"""
ENCODING = "utf-16-le" if sys.platform == "win32" else "utf-8"
"""of that type; pygame passes the bytes of Windows' own format on"""


class ClipboardError(RuntimeError):
    """The system gives no access to its clipboard; `str()` has the reason."""


def copy_text(text: str) -> None:
    """Put a text into the clipboard.

    Raises:
        ClipboardError: the system gives no access to it. A window must be open.
    """
    try:
        _open()
        pygame.scrap.put(TEXT_TYPE, text.encode(ENCODING, errors="replace"))
    except pygame.error as error:
        raise ClipboardError(f"the text was not copied: {error}") from None


def pasted_text() -> str:
    """Return the text in the clipboard as one line; empty if it holds no text.

    Raises:
        ClipboardError: the system gives no access to it. A window must be open.
    """
    try:
        _open()
        content = pygame.scrap.get(TEXT_TYPE)
    except pygame.error as error:
        raise ClipboardError(f"nothing was pasted: {error}") from None
    text = (content or b"").decode(ENCODING, errors="replace").partition("\0")[0]
    return " ".join(text.strip("\r\n").replace("\t", " ").splitlines())


def _open() -> None:
    if not pygame.scrap.get_init():
        pygame.scrap.init()
