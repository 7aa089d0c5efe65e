"""What a laboratory would run: recordings and a nominal URDF in, an estimate with its uncertainty out."""

from calibration.dataset import Dataset, load

__all__ = ["Dataset", "load"]
