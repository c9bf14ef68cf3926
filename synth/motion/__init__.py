"""What the hand does: scans, strokes, recordings and live updates become place and load at audio rate."""
