"""Step-by-step simulation of contacts with mass, memory or adhesion: their z is no function of place and load."""
