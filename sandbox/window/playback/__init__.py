"""Playback of a session: stepping, undo and seek by replay, ghosts, recorded runs. Nothing here imports pygame."""
