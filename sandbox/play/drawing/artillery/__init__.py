"""How artillery is drawn: sky and ground, tanks, and what flies."""
