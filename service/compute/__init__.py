"""Where work is computed: threads for sessions, processes for renders and measurements, and the bounds on both."""
