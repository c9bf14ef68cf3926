"""What those who run the service see: settings, metrics, logs, health, and several workers as one."""
