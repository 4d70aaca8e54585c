"""Billiards: pool, carom and snooker."""
