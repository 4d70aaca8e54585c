"""Compilation of a scene: bodies, joints, drives and contacts as arrays, and the physics that the scene demands."""
