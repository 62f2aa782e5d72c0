"""evifuse app."""
