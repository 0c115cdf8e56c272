"""Pinhole cameras."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from . import _native

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

    from ._native import CameraTuple


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with OpenCV axes: x right, y down, z forward.

    A point p of the scene lies at (x, y, z) = R·p + t in the camera's frame and at u = fx·x/z + cx, v = fy·y/z + cy in
    the picture; the centre of pixel (i, j) is (i + 0.5, j + 0.5). The frame is the bundle's normalised one, in which the
    training cameras surround the origin; `Bundle.camera` takes poses in the frame of the capture.
    """

    rotation: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    """R, row by row: scene to camera."""
    translation: tuple[float, float, float]
    """t, normalised units."""
    focal_px: tuple[float, float]
    """(fx, fy), pixels."""
    principal_px: tuple[float, float]
    """(cx, cy), pixels from the outer corner of the first pixel."""
    width_px: int
    height_px: int

    @classmethod
    def from_matrices(cls, viewmat: ArrayLike, K: ArrayLike, width_px: int, height_px: int) -> Camera:
        """Takes the matrices of gsplat: `viewmat` [4, 4] or [3, 4], scene to camera; `K` [3, 3], pixels."""
        import numpy

        view, intrinsics = _view_of(viewmat), numpy.asarray(K, dtype=float)
        if intrinsics.shape != (3, 3):
            raise ValueError(f"K of shape {intrinsics.shape}; needed: [3, 3]")
        if not numpy.allclose(intrinsics[2], (0, 0, 1), atol=1e-5):
            raise ValueError(f"the last row of K is {intrinsics[2].tolist()}; needed: 0, 0, 1; transpose it if its last column is that")
        skew = [float(intrinsics[0, 1]), float(intrinsics[1, 0])]
        if not numpy.allclose(skew, 0, atol=1e-3):
            raise ValueError(f"K has a skew of {skew}; needed: 0, 0; undistort the pictures to a camera without")
        rows: Any = tuple(tuple(map(float, row)) for row in view[:, :3])
        translation: Any = tuple(map(float, view[:, 3]))
        focal = (float(intrinsics[0, 0]), float(intrinsics[1, 1]))
        principal = (float(intrinsics[0, 2]), float(intrinsics[1, 2]))
        return cls(rows, translation, focal, principal, width_px, height_px)

    @property
    def viewmat(self) -> NDArray[numpy.float32]:
        """float32 [4, 4]: scene to camera."""
        import numpy

        matrix = numpy.eye(4, dtype=numpy.float32)
        matrix[:3, :3] = self.rotation
        matrix[:3, 3] = self.translation
        return matrix

    @property
    def K(self) -> NDArray[numpy.float32]:
        """float32 [3, 3]: the camera's frame to pixels."""
        import numpy

        (fx, fy), (cx, cy) = self.focal_px, self.principal_px
        return numpy.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], dtype=numpy.float32)

    def resized(self, width_px: int, height_px: int) -> Camera:
        """The same camera for pictures of another size, pixels: nothing of its picture is cut, and nothing is stretched."""
        scale = min(width_px / self.width_px, height_px / self.height_px)
        focal = (self.focal_px[0] * scale, self.focal_px[1] * scale)
        x = width_px / 2 + (self.principal_px[0] - self.width_px / 2) * scale
        y = height_px / 2 + (self.principal_px[1] - self.height_px / 2) * scale
        return replace(self, focal_px=focal, principal_px=(x, y), width_px=width_px, height_px=height_px)

    def orbited(self, angle: float) -> Camera:
        """The camera carried around the scene by `angle`, radians; from above it moves counter-clockwise."""
        return _of_tuple(_native.orbited(_as_tuple(self), angle))


def _view_of(viewmat: ArrayLike) -> NDArray[numpy.float64]:
    """The upper three rows of a matrix from a frame to the camera."""
    import numpy

    view = numpy.asarray(viewmat, dtype=numpy.float64)
    if view.shape not in ((4, 4), (3, 4)):
        raise ValueError(f"viewmat of shape {view.shape}; needed: [4, 4] or [3, 4]")
    if len(view) == 4 and not numpy.allclose(view[3], (0, 0, 0, 1), atol=1e-5):
        raise ValueError(f"the last row of viewmat is {view[3].tolist()}; needed: 0, 0, 0, 1; transpose it if its last column is that")
    return view[:3]


def _as_tuple(camera: Camera) -> CameraTuple:
    for name, size in (("width_px", camera.width_px), ("height_px", camera.height_px)):
        if not 0 < size < 1 << 16:
            raise _native.BundleError(f"{name} of the camera is {size}; needed: 1 to {(1 << 16) - 1}")
    rotation = [number for row in camera.rotation for number in row]
    return (
        rotation,
        list(camera.translation),
        list(camera.focal_px),
        list(camera.principal_px),
        camera.width_px,
        camera.height_px,
    )


def _of_tuple(numbers: CameraTuple) -> Camera:
    rotation, translation, focal, principal, width, height = numbers
    rows: Any = tuple(tuple(rotation[i : i + 3]) for i in (0, 3, 6))
    vector: Any = tuple(translation)
    return Camera(rows, vector, (focal[0], focal[1]), (principal[0], principal[1]), width, height)
