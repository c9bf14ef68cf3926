"""Readers of measured surfaces, one format a file. `file_formats` finds the reader of a file, by content and ending."""
