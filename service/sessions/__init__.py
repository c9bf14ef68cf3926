"""Sessions: their scenes, changes, pacing and ends, for HTTP streams and live connections."""
