"""Limits: what films can be, known without making one. It imports nothing that draws."""

from importlib.util import find_spec

FASTEST_GIF = 50.0
"""pictures/s: viewers show what is quicker than 0.02 s at a tenth of its speed"""
MOST_GIF_PICTURES = 3000
"""Of one gif, which viewers unpack into memory as a whole: 100 s at 30 a second."""
NEEDS_VIDEO = 'mp4 needs the `video` extra: pip install -e ".[video]"; gif works without it'


def can_make_mp4() -> bool:
    """Tell whether the `video` extra is installed."""
    return find_spec("imageio_ffmpeg") is not None
