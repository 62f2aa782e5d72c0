"""evifuse simulation."""
