"""Fixtures of live scenes in a browser."""

from tests.browser import browser as browser
