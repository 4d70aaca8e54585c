"""Billiards in the window: table, balls, aim, cue controls, scoreboard, and the bot as a player."""
