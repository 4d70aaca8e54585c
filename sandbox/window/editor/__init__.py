"""Scene editor of the window."""
