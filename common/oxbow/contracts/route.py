"""Ways to find routes, which an assignment may choose from."""

from __future__ import annotations

import enum

__all__ = ["RouteMethod"]


class RouteMethod(enum.StrEnum):
    """A way to find routes through the water (Innocenti, Pollini and Bracci 2006, section 2).

    `VISIBILITY` finds the shortest routes, or those of least cost where there are danger zones; they touch the
    rim of the free space. `TESSELLATION` searches a lattice of triangles, `FUNNEL` channels of triangles with the
    shortest line through each, `INCENTERS` the same channels with lines that keep off the rim.
    """

    VISIBILITY = "visibility"
    TESSELLATION = "tessellation"
    FUNNEL = "funnel"
    INCENTERS = "incenters"
