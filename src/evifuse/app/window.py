"""The latest samples of a stream, as a recording."""

import numpy as np
from numpy.typing import NDArray

from evifuse.app.samples import Sample
from evifuse.recordings.door import touch_of
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.recording import Fingertip, TouchRecording

__all__ = ["Window"]


class Window:
    """The latest samples; the memory for them is taken once.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    longest : int
        How many samples are kept.
    """

    def __init__(self, fingertip: Fingertip, longest: int) -> None:
        self._tip, self._longest = fingertip, longest
        room, taxels = longest + longest // 2, len(fingertip.positions_m)
        self._time_ns = np.zeros(room, np.int64)
        self._rest = np.zeros((room, 8))
        self._pressure = np.zeros((room, taxels))
        self._stop = 0

    @property
    def time_ns(self) -> int:
        """Time of the last sample; -1 without one."""
        return int(self._time_ns[self._stop - 1]) if self._stop else -1

    def add(self, sample: Sample) -> None:
        """Take a sample; when there is no room left, the latest move to the front.

        Parameters
        ----------
        sample : Sample
            Later than the last.
        """
        if self._stop == len(self._time_ns):
            kept = slice(self._stop - self._longest, self._stop)
            for rows in (self._time_ns, self._rest, self._pressure):
                rows[: self._longest] = rows[kept].copy()
            self._stop = self._longest
        self._time_ns[self._stop] = sample.time_ns
        self._rest[self._stop, :7] = sample.pose
        self._rest[self._stop, 7] = sample.joint_rad
        self._pressure[self._stop] = sample.pressure_pa
        self._stop += 1

    def pressure_pa(self, samples: int) -> NDArray[np.float64]:
        """Pressures of the last samples.

        Parameters
        ----------
        samples : int
            How many at most.

        Returns
        -------
        ndarray of float64, shape (M, N)
            Pascals, oldest first; NaN where a taxel gave none.
        """
        return self._pressure[max(0, self._stop - samples) : self._stop]

    def recording(self, samples: int) -> TouchRecording:
        """The last samples, through the same door as a file.

        Parameters
        ----------
        samples : int
            How many at most.

        Returns
        -------
        TouchRecording
            Its notes say what was left out or interpolated.

        Raises
        ------
        RecordingError
            If nothing of them can be used.
        """
        kept = slice(max(0, self._stop - min(samples, self._longest)), self._stop)
        time_ns = self._time_ns[kept]
        return touch_of(
            RawTouch(
                "live",
                time_ns=time_ns,
                pressure=self._pressure[kept],
                unit="Pa",
                pose_time_ns=time_ns,
                pose=self._rest[kept, :7],
                joint_time_ns=time_ns,
                joint_rad=self._rest[kept, 7],
                radius_m=self._tip.radius_m,
                positions_m=self._tip.positions_m,
                normals=self._tip.normals,
                called={"time": "time_ns", "pose": "the pose", "joint": "joint_angle_rad"},
            )
        )
