"""Neural Gaussian-splat scenes in files of a fraction of a megabyte.

    import pocketsplat

    bundle = pocketsplat.Bundle.open("scene.psb")
    picture = bundle.render()                      # uint8 [height, width, 3]
    turned = bundle.render(bundle.preview.orbited(0.5))

`train` trains one from photographs. The command `pocketsplat` comes with the package.
"""

from ._bundle import Bundle, GaussianArrays, Header, Plan, Tier
from ._camera import Camera
from ._native import BudgetError, BundleError, __version__
from ._train import Progress, TrainError, Training, train

__all__ = [
    "BudgetError",
    "Bundle",
    "BundleError",
    "Camera",
    "GaussianArrays",
    "Header",
    "Plan",
    "Progress",
    "Tier",
    "TrainError",
    "Training",
    "__version__",
    "train",
]
