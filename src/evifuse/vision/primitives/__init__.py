"""evifuse vision/primitives."""
