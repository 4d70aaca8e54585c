"""Games: their rules, which read what happened and know no engine."""
