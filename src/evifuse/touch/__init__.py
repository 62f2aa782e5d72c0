"""evifuse touch."""
