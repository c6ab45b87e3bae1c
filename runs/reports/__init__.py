"""Pages of studies and campaigns."""
