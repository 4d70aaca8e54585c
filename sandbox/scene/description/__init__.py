"""Description of a scene: one frozen model for each element of a scene file."""
