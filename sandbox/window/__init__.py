"""The window: plays scenes interactively, and shows stored runs."""

import os

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a message on import
