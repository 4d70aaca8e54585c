"""Engines: interchangeable simulators of a scene."""
