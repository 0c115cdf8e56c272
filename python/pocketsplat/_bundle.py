"""Bundles: what is in them, and pictures of them."""

from __future__ import annotations

import html
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypedDict

from . import _native
from ._camera import Camera, _as_tuple, _of_tuple, _view_of

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

    from ._native import Limits

# What the decoder counts with.
_U8, _U16 = (1 << 8) - 1, (1 << 16) - 1

# The process whose threads draw.
_drawing_pid: int | None = None

Quality = Literal["exact", "balanced", "draft"]


@dataclass(frozen=True)
class Header:
    """What a bundle is."""

    n_bytes: int
    """Length of the file, everything inside."""
    n_anchors: int
    n_offsets: int
    """Gaussians of an anchor at most, K."""
    feature_dim: int
    """Width of an anchor's feature, F."""
    uses_context: bool
    """Whether a context model codes the anchors; static tables do else."""
    view_colour: bool
    view_geometry: bool
    view_distance: bool
    anisotropic: bool
    dilation_compensation: bool
    background: tuple[int, int, int]
    """RGB, 0 to 255."""
    training_px: tuple[int, int]
    """Width and height of the training images."""
    voxel_size: float
    """Edge of a lattice cell, normalised units."""
    normalisation_centre: tuple[float, float, float]
    """The origin of the normalised frame, in the frame of the capture."""
    normalisation_scale: float
    """Normalised units for each unit of the capture: normalised = (capture - centre) * scale."""


@dataclass(frozen=True)
class Tier:
    """The scene of one tier and those before it."""

    n_anchors: int
    n_bytes: int
    """Length of the file cut there, which is a sound bundle."""
    pruning_rate: float
    """Share of the anchors that is left out, 0 to 1."""
    psnr_db: float | None
    """Over at most 12 test views, or the training views that `validation_every` held out; where it was measured."""


@dataclass(frozen=True)
class Plan:
    """What a decoder does within a budget of memory."""

    scratch_bytes: int
    """Memory that the decoder needs, to the byte."""
    n_tiers: int
    pruning_rate: float
    n_strips: int
    """Horizontal parts that a frame is drawn in."""
    max_splats: int
    """Splats of a strip that there is memory for."""
    is_resident: bool
    """Whether anchors are decoded once and kept."""
    is_baked: bool
    """Whether Gaussians are evaluated once and kept."""


class GaussianArrays(TypedDict):
    """The Gaussians that a camera sees, by gsplat's names; all float32, in the normalised frame.

    gsplat adds 0.3 px² to every splat, as the decoder does in frames of the training size. Where
    `header.dilation_compensation` is set, take `rasterize_mode="antialiased"`.
    """

    means: NDArray[numpy.float32]
    """[n, 3]"""
    quats: NDArray[numpy.float32]
    """[n, 4], w first, of length 1"""
    scales: NDArray[numpy.float32]
    """[n, 3], standard deviations"""
    opacities: NDArray[numpy.float32]
    """[n], 0 to 1"""
    colors: NDArray[numpy.float32]
    """[n, 3], RGB from 0 to 1"""


class Bundle:
    """A scene as one file, checked when it is opened."""

    def __init__(self, data: bytes) -> None:
        """Takes the bytes of a bundle.

        Raises BundleError where they are none, or are damaged.
        """
        self._native = _native.Bundle(bytes(data))
        self.header: Header = Header(**self._native.header())
        """What the bundle is."""

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Bundle:
        """Reads a file.

        Raises OSError where it cannot be read, BundleError where it is no sound bundle.
        """
        with open(path, "rb") as file:
            data = file.read()
        try:
            return cls(data)
        except _native.BundleError as error:
            raise type(error)(f"{os.fspath(path)}: {error}") from None

    @property
    def tiers(self) -> list[Tier]:
        """The scenes that smaller devices see, the smallest first; the last one is the whole."""
        return [Tier(*numbers) for numbers in self._native.tiers()]

    @property
    def preview(self) -> Camera:
        """The camera that the bundle holds: the first training camera."""
        return _of_tuple(self._native.preview())

    def camera(self, viewmat: ArrayLike, K: ArrayLike, width_px: int, height_px: int) -> Camera:
        """A camera by its pose in the frame of the capture, as its photographs have them.

        `viewmat` [4, 4] or [3, 4] takes the capture to the camera (OpenCV axes); `K` [3, 3] the camera to pixels.
        """
        import numpy

        view = _view_of(viewmat)
        # x = R·c + t with c = n / scale + centre; times scale, as a picture does not change with it.
        translation = (view[:, 3] + view[:, :3] @ self.header.normalisation_centre) * self.header.normalisation_scale
        return Camera.from_matrices(numpy.column_stack([view[:, :3], translation]), K, width_px, height_px)

    def plan(
        self,
        ram: int | None = None,
        size: tuple[int, int] | None = None,
        *,
        tiers: int | None = None,
        quality: Quality = "exact",
    ) -> Plan:
        """What a decoder draws of the scene in `ram` bytes; without `ram` all of it.

        `size` is the frame's width and height, by default the preview's; `tiers` how many are drawn at most.

        Raises BudgetError where no plan fits; its args[1] is the number of bytes with which one would.
        """
        return Plan(**self._native.plan(self._limits(size, ram, tiers, quality)))

    def render(
        self,
        camera: Camera | Sequence[Camera] | None = None,
        *,
        ram: int | None = None,
        tiers: int | None = None,
        quality: Quality = "exact",
    ) -> NDArray[numpy.uint8]:
        """The picture that a camera sees: uint8 [height, width, 3], the pixels that a device draws.

        Several cameras of one size give [n, height, width, 3], on all cores. Without a camera it is the preview's picture.
        With `ram` the picture is that of a device with so much memory, which may leave out tiers.

        Raises BundleError for a camera that cannot be drawn, BudgetError where no plan fits `ram`, RuntimeError for several cameras in a
        process that was forked from one that had drawn several.
        """
        import numpy

        if camera is None:
            camera = self.preview
        cameras = [camera] if isinstance(camera, Camera) else list(camera)
        sizes = {(each.width_px, each.height_px) for each in cameras}
        if len(sizes) != 1:
            raise ValueError(f"cameras of {len(sizes)} sizes; needed: one size, of at least one camera")
        (width, height) = sizes.pop()
        limits = self._limits((width, height), ram, tiers, quality)
        if len(cameras) > 1:
            _check_threads()
        pixels = self._native.render([_as_tuple(each) for each in cameras], limits)
        pictures = numpy.frombuffer(pixels, dtype=numpy.uint8).reshape(len(cameras), height, width, 3)
        return pictures[0] if isinstance(camera, Camera) else pictures

    def gaussians(self, camera: Camera | None = None) -> GaussianArrays:
        """The Gaussians that a camera sees, as the heads make them for it; without a camera the preview's.

        They lie in the normalised frame, like the camera. How gsplat draws them stands in the package's README.

        Raises BundleError for a camera that cannot be drawn, RuntimeError as `render` does.
        """
        import numpy

        _check_threads()
        arrays = self._native.gaussians(_as_tuple(camera or self.preview))
        means, quats, scales, opacities, colors = (numpy.frombuffer(part, dtype="<f4") for part in arrays)
        return {
            "means": means.reshape(-1, 3),
            "quats": quats.reshape(-1, 4),
            "scales": scales.reshape(-1, 3),
            "opacities": opacities,
            "colors": colors.reshape(-1, 3),
        }

    def page(self, title: str = "scene") -> str:
        """The page of `pocketsplat view`: one HTML file that draws the scene in a browser and fetches nothing."""
        return self._native.page(title)

    def _limits(self, size: tuple[int, int] | None, ram: int | None, tiers: int | None, quality: str) -> Limits:
        if size is None:
            preview = self.preview
            size = (preview.width_px, preview.height_px)
        for name, number, most in (("width", size[0], _U16), ("height", size[1], _U16), ("tiers", tiers, _U8), ("ram", ram, sys.maxsize)):
            if number is not None and not 0 <= number <= most:
                raise _native.BundleError(f"{name} is {number}; needed: 0 to {most}")
        return (size, ram, tiers, quality)

    def _repr_html_(self) -> str:
        """Shows the scene in a notebook, to be turned by the mouse."""
        page = html.escape(self.page(), quote=True)
        return f'<iframe srcdoc="{page}" sandbox="allow-scripts allow-downloads" style="width: 100%; height: 480px; border: 0"></iframe>'

    def __repr__(self) -> str:
        header = self.header
        return f"<pocketsplat.Bundle: {header.n_anchors} anchors, {header.n_bytes} bytes, {len(self.tiers)} tiers>"


def _check_threads() -> None:
    """A fork has none of its parent's threads, and would wait for them without end."""
    global _drawing_pid
    if _drawing_pid is None:
        _drawing_pid = os.getpid()
    elif _drawing_pid != os.getpid():
        raise RuntimeError(
            'this process was forked from one that drew, whose threads it has not; start it anew: multiprocessing.get_context("spawn")'
        )
