"""What a game of artillery adds to the sight of a moment."""
