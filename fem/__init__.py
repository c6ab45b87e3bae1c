"""Bodies: elements, materials and their assembly into PETSc matrices."""

from fem import petsc as petsc
