"""What rounding can do to coordinates, and how large they can be."""

from __future__ import annotations

__all__ = ["FARTHEST_M", "ROUNDING", "ROUNDING_M"]

FARTHEST_M = 2.1e7
"""No place on Earth is farther from the origin of a mission's plane, an azimuthal equidistant projection."""

ROUNDING_M = 1e-6
"""Places nearer to each other than this are one, and one this near to an area is in it: to project, turn and
intersect moves places by far less."""

ROUNDING = 2.0**-48
"""How exact coordinates are, as a share of the greatest one: a few units in the last place."""
