"""The Python client of the live protocol: `Live` and `AsyncLive`."""
