"""The Python client of the service over HTTP: `Client` and `AsyncClient`."""
