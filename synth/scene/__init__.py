"""The scene that a user requests: its sections, units and rules, its JSON text, merging, and the catalogue."""
