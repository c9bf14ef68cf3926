"""The routes, one file per resource: each module has a `router` that `service.app` includes."""
