"""Bodies: elements, materials and their assembly into PETSc matrices."""

from fem import kernel_cache
from fem import petsc as petsc

kernel_cache.keep()
