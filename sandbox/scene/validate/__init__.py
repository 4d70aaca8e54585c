"""Checks of a scene as a whole: references between elements, start positions, geometry."""
