"""Limits of film formats, and the optional dependency of mp4; the command line checks them without importing pygame."""

from importlib.util import find_spec

FILM_SUFFIXES = (".gif", ".mp4")
MAX_GIF_RATE = 50.0
"""pictures/s: viewers show a picture with a shorter duration than 0.02 s for 0.1 s"""
MAX_GIF_FRAMES = 3000
"""maximum number of pictures of a gif, 100 s at 30 pictures/s: viewers unpack the whole gif into memory"""
NEEDS_VIDEO = 'mp4 needs the `video` extra: pip install -e ".[video]"; gif works without it'


def can_make_mp4() -> bool:
    """Return whether the `video` extra is installed."""
    return find_spec("imageio_ffmpeg") is not None
