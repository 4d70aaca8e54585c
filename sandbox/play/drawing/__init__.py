"""Drawing: one moment of a scene as a picture. Knows scenes, bodies and frames; nothing of any engine."""
