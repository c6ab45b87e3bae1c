"""The catalogue: one file a family, one function a case; imported, they stand in `validation.case.CASES`."""

from validation.cases import (  # noqa: F401
    axisymmetric,
    bars,
    beams,
    columns,
    cylinders,
    half_plane,
    impacts,
    layers,
    membranes,
    patch,
    rods,
    spheres,
    tubes,
    walls,
)
