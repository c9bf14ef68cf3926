"""Encode blocks to WAV, FLAC and PCM with metadata. `formats` is the entry point; `sound` holds a finite render."""
