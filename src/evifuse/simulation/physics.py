"""One fingertip in MuJoCo: a free sphere that is pressed on a surface and rolled by its joint.

The surface takes part in the physics as a plane that is moved to the surface's nearest point before every
step, so there is exactly one contact and its normal is exact, whatever the shape. Friction alone makes the
finger travel.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import MissingExtraError
from evifuse.simulation.surface import Surface, Triple

__all__ = ["COVER_M", "PRESS_N", "FingerWorld", "load_mujoco"]

MASS_KG = 0.02
PRESS_N = 2.0
"""Force with which the arm usually presses the finger along the surface normal."""
COVER_M = float(np.sqrt(PRESS_N / (np.pi * 3e9 * 0.01)))
"""How deep that force presses the usual skin of a ball of 10 mm into a plane: 0.15 mm.

In MuJoCo the contact is as stiff as it takes for the rolling radius under load to be the fingertip's nominal
one, which is what a calibration by rolling on a plane gives: the sphere of MuJoCo is larger than that by this
much, is pressed in by twice as much, and MuJoCo applies the friction half way.
"""
JOINT_LAG_S = 0.005
"""Time constant with which the joint follows its commanded speed."""

_WORLD = """
<mujoco>
  <option timestep="{timestep}" gravity="0 0 0" cone="elliptic" impratio="20" integrator="implicitfast"/>
  <default>
    <geom condim="4" friction="1.2 0.005 0" solref="{lag} 1" solimp="0.9 0.9 0.001"/>
  </default>
  <worldbody>
    <body name="surface" mocap="true"><geom type="plane" size="1 1 1"/></body>
    <body name="finger"><freejoint/><geom type="sphere" size="{radius}" mass="{mass}"/></body>
  </worldbody>
</mujoco>
"""
_FINGER = 2  # number of the finger's body; 0 is the world, 1 the surface
_CONTACT_LAG_S = 0.00548  # with the mass and force above, a penetration of twice so much:
_LAG_M = 0.15e-3


def load_mujoco() -> Any:
    """Import MuJoCo.

    Returns
    -------
    module
        ``mujoco``.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError(
            "simulation needs MuJoCo, which is not installed: pip install 'evifuse[simulation]'"
        ) from error
    return mujoco


class FingerWorld:
    """A MuJoCo world with one surface and one fingertip.

    Parameters
    ----------
    surface : Surface
        What the fingertip touches.
    radius_m : float
        Radius of the fingertip, metres.
    timestep_s : float
        Length of a physics step, seconds.
    press_n : float
        Force along the surface normal, newtons.
    """

    def __init__(
        self,
        surface: Surface,
        radius_m: float,
        timestep_s: float,
        press_n: float = PRESS_N,
    ) -> None:
        self._mujoco = load_mujoco()
        text = _WORLD.format(timestep=timestep_s, radius=radius_m, mass=MASS_KG, lag=_CONTACT_LAG_S)
        self._press_n = press_n
        self._model = self._mujoco.MjModel.from_xml_string(text)
        self._data = self._mujoco.MjData(self._model)
        self._surface = surface
        self.radius_m = radius_m
        inertia = 1.4 * MASS_KG * radius_m**2  # of a ball that rolls about its contact point
        self._joint_gain = inertia / JOINT_LAG_S
        self._mj_step = self._mujoco.mj_step
        # views of MuJoCo's own memory: asking for them anew would take longer than the physics
        data = self._data
        self._pose, self._turning = data.qpos, data.qvel[3:6]
        self._plane_m, self._plane_wxyz = data.mocap_pos[0], data.mocap_quat[0]
        self._applied = data.xfrc_applied[_FINGER]

    def place(
        self,
        position_m: NDArray[np.float64],
        orientation_xyzw: NDArray[np.float64],
        depth_m: float = COVER_M,
    ) -> None:
        """Put the finger somewhere, at rest.

        Parameters
        ----------
        position_m : ndarray of float64, shape (3,)
            Centre of the fingertip, world frame, metres.
        orientation_xyzw : ndarray of float64, shape (4,)
            Its orientation.
        depth_m : float
            How deep the force presses the taxels in here, metres.
        """
        size = self.radius_m + depth_m
        self._model.geom_size[_FINGER - 1, 0] = self._model.geom_rbound[_FINGER - 1] = size
        self._model.geom_solref[:, 0] = _CONTACT_LAG_S * math.sqrt(depth_m / _LAG_M * PRESS_N / self._press_n)
        self._pose[:3] = position_m
        self._pose[3:] = np.roll(orientation_xyzw, 1)
        self._data.qvel[:] = 0.0
        self._mujoco.mj_kinematics(self._model, self._data)

    @property
    def pose(self) -> NDArray[np.float64]:
        """Centre of the fingertip, metres, and its orientation as w, x, y, z, shape (7,): a view."""
        return self._pose

    def step(self, binormal: Triple, speed_rad_per_s: float) -> None:
        """Press and roll for one physics step.

        Parameters
        ----------
        binormal : tuple of float
            Unit normal of the vertical plane in which the finger is to roll, world frame: surface normal at
            the site x commanded direction.
        speed_rad_per_s : float
            Commanded speed of the joint.
        """
        x, y, z, w, i, j, k = self._pose.tolist()
        nearest, (nx, ny, nz) = self._surface.nearest_one(x, y, z)
        self._plane_m[:] = nearest
        if nz > -1.0 + 1e-9:
            scale = math.sqrt(2.0 * (1.0 + nz))  # shortest rotation from +z to the normal
            self._plane_wxyz[:] = (scale / 2, -ny / scale, nx / scale, 0.0)
        else:
            self._plane_wxyz[:] = (0.0, 1.0, 0.0, 0.0)
        bx, by, bz = binormal
        along = bx * nx + by * ny + bz * nz
        ax, ay, az = bx - along * nx, by - along * ny, bz - along * nz
        speed = speed_rad_per_s / math.sqrt(ax * ax + ay * ay + az * az)
        # how the finger turns now, from its own frame into the world's: v + 2 q x (q x v + w v)
        p, q, r = self._turning.tolist()
        u, v, t = j * r - k * q + w * p, k * p - i * r + w * q, i * q - j * p + w * r
        p, q, r = p + 2 * (j * t - k * v), q + 2 * (k * u - i * t), r + 2 * (i * v - j * u)
        press, gain = -self._press_n, self._joint_gain
        self._applied[:] = (
            press * nx,
            press * ny,
            press * nz,
            gain * (speed * ax - p),
            gain * (speed * ay - q),
            gain * (speed * az - r),
        )
        self._mj_step(self._model, self._data)
