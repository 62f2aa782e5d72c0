"""Layouts of the Paxini GEN3 sensors, as the installed package ``paxini-sdk`` ships them.

The vendor gives places only, in millimetres, in the sensor's own frame: x across, y along the finger towards
its tip, z out of the pad. The normals are estimated here. The frame is then turned half around y, tilted so
that the pole's normal is -z, and moved so that the centre of the best sphere at the pole is the origin: y
still runs towards the tip.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from evifuse.errors import MissingExtraError, UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.touch.blended import layout_normals
from evifuse.touch.pole import facing_down

__all__ = ["PaxiniSensor", "paxini_fingertip", "paxini_sensors"]

_MODEL = "PX6AX-GEN3-"
_PART = "PXSR-STD"


@dataclass(frozen=True)
class PaxiniSensor:
    """One sensor of the vendor's list.

    Parameters
    ----------
    name : str
        Model without its common beginning, as in ``DP-S2015-Elite``.
    part_code : str
        The vendor's part code, as in ``PXSR-STDDP03G``.
    kind : str
        What the vendor calls its shape: ``fingertip``, ``finger_pad``, ``integrated_tip_pad``, ``palm``.
    taxels : int
        How many taxels it has.
    """

    name: str
    part_code: str
    kind: str
    taxels: int


def paxini_sensors() -> tuple[PaxiniSensor, ...]:
    """List the sensors whose layouts are there.

    Returns
    -------
    tuple of PaxiniSensor
        By name.

    Raises
    ------
    MissingExtraError
        If ``paxini-sdk`` is not installed.
    """
    return tuple(sorted((_sensor(entry) for entry in _registry().list_sensors()), key=lambda s: s.name))


def paxini_fingertip(name: str) -> Fingertip:
    """Layout of one sensor.

    Parameters
    ----------
    name : str
        Model or part code, with or without its common beginning; upper and lower case don't matter.

    Returns
    -------
    Fingertip
        Facing -z, y towards the tip of the finger; the radius is that of the best sphere at the pole.

    Raises
    ------
    UsageError
        If there is no such sensor.
    MissingExtraError
        If ``paxini-sdk`` is not installed.
    """
    registry = _registry()
    wanted = name.strip().upper().removeprefix(_MODEL.upper()).removeprefix(_PART)
    for entry in registry.list_sensors():
        sensor = _sensor(entry)
        if wanted in (sensor.name.upper(), sensor.part_code.upper().removeprefix(_PART)):
            places = 1e-3 * np.array(registry.load_points(entry), dtype=np.float64)
            down = places * [-1.0, 1.0, -1.0]  # half a turn about y
            return facing_down(Fingertip(1.0, down, layout_normals(down)))
    known = ", ".join(sensor.name for sensor in paxini_sensors())
    raise UsageError(f"there is no Paxini sensor {name!r}: use one of {known}")


def _registry() -> Any:
    try:
        from paxini_sdk import sensor_registry
    except ImportError as error:
        raise MissingExtraError("Paxini layouts need paxini-sdk: pip install 'evifuse[paxini]'") from error
    return sensor_registry


def _sensor(entry: Any) -> PaxiniSensor:
    model = str(entry.sensor_model).removeprefix(_MODEL)
    return PaxiniSensor(model, str(entry.vendor_part_code), str(entry.geometry), int(entry.n_points))
