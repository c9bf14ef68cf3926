"""What is felt of a vibration: detection thresholds."""
