"""What the command line says about a recording that leaves it open."""

from evifuse.recordings.raw import Given
from evifuse.recordings.topics import parse_topics

__all__ = ["given_by"]


def given_by(fingertip: str | None, topics: str | None, unit: str | None) -> Given:
    """Read ``--fingertip``, ``--topics`` and ``--unit``.

    Parameters
    ----------
    fingertip : str or None
        Name or file of a layout.
    topics : str or None
        Topics of pose, pressures and joint.
    unit : str or None
        Unit of the readings.

    Returns
    -------
    Given
        What takes the place of what a recording says.

    Raises
    ------
    InputError
        If there is no such layout, or the topics are not of the form that is expected.
    """
    tip = None
    if fingertip is not None:
        from evifuse.touch.layouts import load_fingertip

        tip = load_fingertip(fingertip)
    return Given(tip, {} if topics is None else parse_topics(topics), unit)
