"""mvcodec: a free-viewpoint video codec for sparse camera arrays."""

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.errors import MvCodecError

__version__ = "0.1.0"
__all__ = ["Calibration", "CameraArray", "MvCodecError", "Viewpoint", "__version__"]
