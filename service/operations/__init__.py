"""What operators of the service see: settings, metrics, logs, health, and several workers as one."""
