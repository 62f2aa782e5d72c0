"""evifuse fusion."""
