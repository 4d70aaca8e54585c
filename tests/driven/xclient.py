"""X requests that xdotool lacks: asking a window to close, and removing the keyboard focus from all windows."""

import ctypes
from ctypes.util import find_library

LIBRARY = find_library("X11")
_CLIENT_MESSAGE = 33


class _ClientMessage(ctypes.Structure):
    """XClientMessageEvent of Xlib.h, padded to an XEvent."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
        ("rest", ctypes.c_long * 24),
    )


class XClient:
    """A connection to a display, open as a context."""

    def __init__(self, display: str) -> None:
        assert LIBRARY is not None
        self._x = ctypes.CDLL(LIBRARY)
        self._x.XOpenDisplay.restype = ctypes.c_void_p
        self._x.XInternAtom.restype = ctypes.c_ulong
        self._display = ctypes.c_void_p(self._x.XOpenDisplay(display.encode()))
        assert self._display.value

    def __enter__(self) -> "XClient":
        return self

    def __exit__(self, *_: object) -> None:
        self._x.XSync(self._display, 0)
        self._x.XCloseDisplay(self._display)

    def ask_to_close(self, window: int) -> None:
        """Send the message that a window manager sends when its close button is clicked."""
        protocols, delete = (
            self._x.XInternAtom(self._display, name, 0) for name in (b"WM_PROTOCOLS", b"WM_DELETE_WINDOW")
        )
        event = _ClientMessage(type=_CLIENT_MESSAGE, window=window, message_type=protocols, format=32)
        event.data[0] = delete
        self._x.XSendEvent(self._display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(event))

    def take_focus_away(self) -> None:
        """Remove the keyboard focus from all windows."""
        self._x.XSetInputFocus(self._display, ctypes.c_ulong(0), 0, ctypes.c_ulong(0))
