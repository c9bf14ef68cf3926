"""Where work is computed: threads for sessions, processes for renders and measurements, and what bounds both."""
