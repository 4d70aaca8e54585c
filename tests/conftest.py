"""Shared by all tests; being here, it also makes `strategies` importable from every folder."""

from hypothesis import settings

settings.register_profile("sandbox", deadline=None, max_examples=60)  # no test asserts on time
settings.load_profile("sandbox")
