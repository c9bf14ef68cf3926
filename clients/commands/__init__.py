"""The commands of `ridgewave`, one per file; each has `run(arguments) -> int`."""
