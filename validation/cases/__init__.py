"""The catalogue: one file a family, one function a case; imported, they stand in `validation.case.CASES`."""

from validation.cases import axisymmetric, bars, cylinders, half_plane, impacts, layers, membranes

__all__ = ["axisymmetric", "bars", "cylinders", "half_plane", "impacts", "layers", "membranes"]
