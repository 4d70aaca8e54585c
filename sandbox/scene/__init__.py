"""The description of a scene, apart from every engine."""
