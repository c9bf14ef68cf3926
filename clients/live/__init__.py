"""The Python client of the live protocol, with threads and with an event loop."""
