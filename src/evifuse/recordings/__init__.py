"""evifuse recordings."""
