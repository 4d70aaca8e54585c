"""Input: key table, gamepads, keys of games, mouse tools on bodies."""
