"""Two ranks give what one gives."""

import rank_examples
from ranks import same_on_two_ranks


def test_two_ranks() -> None:
    """Quantities of nodal and mortar contact in 2 and 3 dimensions, of membranes, mixed and rigid bodies, in time."""
    same_on_two_ranks(rank_examples)
