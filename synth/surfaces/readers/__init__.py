"""Readers of measured surfaces, one module per format. `file_formats` finds the reader by content and ending."""
