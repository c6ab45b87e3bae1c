"""Contact: surfaces, detection, constraints, the Delassus operator, the contact solvers and the step."""

from fem import petsc as petsc
