"""evifuse .."""
