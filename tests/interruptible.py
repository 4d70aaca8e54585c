"""The command line as a process that Ctrl-C reaches, wherever the tests were started from."""

import sys

# A shell may start its children with SIGINT ignored, and they would inherit that.
_MAIN = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module("sandbox", run_name="__main__", alter_sys=True)
"""


def interruptible(*words: str) -> list[str]:
    """Return what runs the command line in a process that heeds SIGINT."""
    return [sys.executable, "-c", _MAIN, *words]
