"""Screenshots and films: png, gif and mp4 files."""
