"""Blocks to WAV, FLAC and PCM with their metadata; `formats` is the door, `sound` a finite render as a value."""
