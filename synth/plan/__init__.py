"""What will be simulated for a scene: the methods, their reasons, costs and errors, and the warnings."""
