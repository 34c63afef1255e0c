"""How far rounding can move coordinates, how large they can be, and how exact a mission is assumed to be."""

from __future__ import annotations

__all__ = [
    "DEFAULT_LEAST_WIDTH_M",
    "DEFAULT_SHORE_TOLERANCE_M",
    "DISTANCE_ROUNDING",
    "FARTHEST_M",
    "HAIR_M",
    "ON_SHORE_M",
    "ROUNDING",
    "ROUNDING_M",
]

FARTHEST_M = 2.1e7
"""No place on Earth is farther from the origin of a mission's plane, an azimuthal equidistant projection."""

ROUNDING_M = 1e-6
"""Places closer together than this are one, and a place this close to an area is in it: projecting, rotating and
intersecting move places by far less."""

ROUNDING = 2.0**-48
"""The precision of coordinates, as a share of the greatest one: a few units in the last place."""

DISTANCE_ROUNDING = 1e-9
"""Distances and offsets computed in two ways agree to within this share."""

ON_SHORE_M = 5e-3
"""A place ashore that is no farther than this from the water is on its shore: the seventh decimal of a degree is a
centimetre."""

HAIR_M = 1e-3
"""How far apart the ways out and home run over land: enough not to touch, too little to measure."""

DEFAULT_SHORE_TOLERANCE_M = 25.0
"""How far ashore a vehicle may start or be recovered."""

DEFAULT_LEAST_WIDTH_M = 0.1
"""Water narrower than this is not water."""
