"""Motion of the finger: scans, strokes, recordings and live updates become position and load at audio rate."""
