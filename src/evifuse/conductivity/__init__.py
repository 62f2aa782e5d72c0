"""evifuse conductivity."""
