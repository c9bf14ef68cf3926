"""Perception of vibrations: detection thresholds."""
