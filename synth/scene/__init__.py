"""What was asked for: the sections of a scene, their units and rules, text, merge, and the catalogue."""
