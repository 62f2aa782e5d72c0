"""evifuse knowledge."""
