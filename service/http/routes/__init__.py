"""The routes, one resource a file: each module has a `router` that `service.app` includes."""
