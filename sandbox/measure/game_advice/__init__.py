"""Advice for a game itself: its program runs again with recorded inputs and other settings of the physics."""
