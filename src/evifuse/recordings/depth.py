"""Pictures of depths: metres along the camera's z axis at each pixel."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import ImageError
from evifuse.recordings.headers import declared_size
from evifuse.recordings.images import MAX_PIXELS, bytes_of, decoded

__all__ = ["read_depth"]


def read_depth(path: str | Path) -> NDArray[np.float64]:
    """Read a depth picture.

    Parameters
    ----------
    path : str or Path
        NumPy file (``.npy``) or picture (PNG, TIFF) with one channel. Floats are metres; 16-bit whole numbers
        are millimetres, as ROS has them. 0, NaN and infinity mean that nothing was measured.

    Returns
    -------
    ndarray of float64, shape (H, W)
        Metres; NaN where nothing was measured.

    Raises
    ------
    ImageError
        If the file can't be read, is no depth picture, or nothing was measured in it.
    """
    file = Path(path)
    values = _npy(file) if file.suffix.lower() == ".npy" else _picture(file)
    if values.ndim != 2:
        raise ImageError(f"depth {file} has shape {values.shape}: expected (height, width)")
    if values.dtype.kind == "f":
        depth = values.astype(np.float64)
    elif values.dtype == np.uint16:
        depth = values.astype(np.float64) / 1000
    else:
        raise ImageError(f"depth {file} holds {values.dtype}: expected floats in m or 16-bit integers in mm")
    depth[~np.isfinite(depth) | (depth == 0)] = np.nan
    if np.nanmin(depth, initial=np.inf) < 0:
        raise ImageError(f"depth {file} holds negative depths: expected metres from the camera")
    if np.isnan(depth).all():
        raise ImageError(f"depth {file}: nothing was measured in it: every pixel is 0 or NaN")
    return depth


def _npy(file: Path) -> NDArray[np.generic]:
    try:
        values = np.load(file, mmap_mode="r", allow_pickle=False)
    except FileNotFoundError:
        raise ImageError(f"depth {file} does not exist: check the path") from None
    except (OSError, ValueError, EOFError, MemoryError) as error:
        raise ImageError(f"depth {file} is not a NumPy file that can be read: {error}") from None
    if values.size > MAX_PIXELS:
        raise ImageError(f"depth {file} has shape {values.shape}: use at most {MAX_PIXELS:,} pixels")
    return values


def _picture(file: Path) -> NDArray[np.generic]:
    data = bytes_of(file)
    width, height = declared_size(data) or (0, 0)
    if width * height > MAX_PIXELS:
        raise ImageError(f"depth {file} is {width} x {height} px: use at most {MAX_PIXELS:,} pixels")
    values = decoded(data) if width else None
    if values is None:
        raise ImageError(f"{file} is not a depth picture that can be read: use NPY, PNG or TIFF")
    return values
