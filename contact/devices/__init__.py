"""Contact of beams: sampled points against surfaces that stand still or give way."""
