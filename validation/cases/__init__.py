"""The catalogue: one file a family, one function a case. Importing this package enters them into `validation.case.CASES`."""

from validation.cases import axisymmetric, bars, cylinders, half_plane, layers, membranes

__all__ = ["axisymmetric", "bars", "cylinders", "half_plane", "layers", "membranes"]
