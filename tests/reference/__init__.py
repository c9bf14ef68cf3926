"""Slow, plainly right references for the tests; nothing here may import ``synth`` (see README.md)."""
