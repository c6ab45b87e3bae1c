"""Beams: elements, sections, and the chain of blocks that their matrices are."""
