"""Running: sessions and stored runs driven by real time, and what runs beside them. No pygame."""
