"""Shape checks of jaxtyping under pytest only, and quiet hypothesis settings."""

from hypothesis import settings

settings.register_profile("evifuse", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("evifuse")
