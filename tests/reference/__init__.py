"""Slow, plainly correct references for the tests; none of them may import ``synth`` (see README.md)."""
