"""Games: scene tables, rules, bots and views. Each is a package with a `GameSpec`, listed in `sandbox.game_names`."""
