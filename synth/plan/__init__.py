"""The plan of a scene: what is simulated, and the methods, reasons, costs, errors and warnings."""
