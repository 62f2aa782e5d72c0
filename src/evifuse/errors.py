"""What can go wrong, as one tree.

EvifuseError
├── InputError              the user's input is at fault: exit code 2
│   ├── BeliefError         a frame or a mass function is not one
│   │   ├── FrameError      hypotheses unknown, repeated, or frames mixed
│   │   ├── MassError       masses negative, NaN, or not summing to 1
│   │   └── ConflictError   sources contradict each other totally
│   ├── KnowledgeError      a knowledge base can't be read or names unknown labels
│   ├── ImageError          an image can't be read or used
│   ├── RecordingError      a recording can't be read or used
│   └── UsageError          options contradict each other
└── MissingExtraError       an optional dependency is not installed: exit code 2

Every message is one line that says what is wrong, where, and what to do about it.
"""

__all__ = [
    "BeliefError",
    "ConflictError",
    "EvifuseError",
    "FrameError",
    "ImageError",
    "InputError",
    "KnowledgeError",
    "MassError",
    "MissingExtraError",
    "RecordingError",
    "UsageError",
]


class EvifuseError(Exception):
    """Base of every error that evifuse raises on purpose."""


class InputError(EvifuseError, ValueError):
    """The input is at fault; the message says what, where and what to do."""


class BeliefError(InputError):
    """A frame or a mass function is not a valid one."""


class FrameError(BeliefError):
    """A hypothesis is unknown or repeated, or two frames are mixed."""


class MassError(BeliefError):
    """Masses are negative, not finite, on the empty set, or do not sum to 1."""


class ConflictError(BeliefError):
    """Two sources contradict each other totally: their combination does not exist."""


class KnowledgeError(InputError):
    """A knowledge base can't be read, or names labels that its frame does not have."""


class ImageError(InputError):
    """An image is missing, broken, or of a kind that can't be used."""


class RecordingError(InputError):
    """A recording is missing, broken, or lacks what an estimate needs."""


class UsageError(InputError):
    """Options contradict each other, or one that is needed is missing."""


class MissingExtraError(EvifuseError, ImportError):
    """An optional dependency is not installed; the message says how to install it."""
