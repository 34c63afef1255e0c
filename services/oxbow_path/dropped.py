"""Water that a path leaves farther away than it means to."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Polygon

from oxbow.contracts import DroppedPart

__all__ = ["dropped_parts"]

QUAD_SEGS = 4
"""Arcs of the path's surroundings are coarse: they err inwards by 2 % at most, so that no gap is overlooked."""

DETAIL = 0.02
"""Bends of the path less than this, in reaches, are left out: those of a smooth path are many."""

LEAST_SHARE = 0.1
"""Smaller parts than this share of a square of side `reach_m` are not worth a line, unless they are as long."""


SPENT, UNREACHED = "the length is spent on other water", "no way there that was tried is better"
"""Why water is left: of a path that uses its length, and of one that does not."""


def dropped_parts(path: LineString, free: Polygon, reach_m: float, *, is_spent: bool) -> tuple[DroppedPart, ...]:
    """The parts of the free space farther than `reach_m` from the path, the largest first.

    Parameters
    ----------
    path, free
        Of one plan.
    reach_m
        What is nearer counts as seen.
    is_spent
        Whether the path uses the length that there is: the reason that is given depends on it.

    Returns
    -------
    tuple of DroppedPart
        Empty where all water of account is within reach.
    """
    why = SPENT if is_spent else UNREACHED
    coarse = path.simplify(DETAIL * reach_m)
    rest = shapely.get_parts(free.difference(coarse.buffer(reach_m, quad_segs=QUAD_SEGS)))
    # A long thin arm has little area, and is missed all the same.
    is_arm = shapely.minimum_bounding_radius(rest) > reach_m / 2
    rest = rest[is_arm | (shapely.area(rest) > LEAST_SHARE * reach_m**2)]
    return tuple(
        DroppedPart(
            area_m2=float(part.area),
            reason=f"farther than {reach_m:.1f} m from the path: {why}",
            place=(float(place.x), float(place.y)),
            outline=part,
        )
        for part, place in ((part, part.representative_point()) for part in rest[np.argsort(-shapely.area(rest))])
    )
