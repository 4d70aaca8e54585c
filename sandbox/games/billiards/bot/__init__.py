"""The bot: it looks for shots by geometry, tries them on the exact engine, and has the rules judge them.

`ease.py` tells how easy a shot is, `aims.py` which strokes to try, `trial.py` what they lead to, `bot.py` chooses.
"""
