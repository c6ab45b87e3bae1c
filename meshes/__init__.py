"""Geometry without PETSc: meshes, their generators, reading and writing."""
