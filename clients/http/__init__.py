"""The Python client of the HTTP API, with and without an event loop."""
