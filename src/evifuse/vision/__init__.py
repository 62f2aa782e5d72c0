"""evifuse vision."""
