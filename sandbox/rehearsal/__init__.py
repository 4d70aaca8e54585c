"""Games that use pymunk, run again with recorded inputs and other settings of the physics."""

import os

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
