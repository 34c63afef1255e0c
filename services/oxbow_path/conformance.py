"""The last check of a path before it leaves: what may never be wrong is verified, not trusted."""

from __future__ import annotations

from shapely import LineString

from oxbow.contracts import PathRequest
from oxbow.errors import Internal
from oxbow.geometry.conformance import strays

__all__ = ["require_conforming"]


def require_conforming(path: LineString, request: PathRequest) -> None:
    """Check that a path is simple, no longer than allowed, and inside the free space except for its legs.

    Parameters
    ----------
    path
        In the planar frame, from launch to recovery.
    request
        The free space, the longest length, and both points.

    Raises
    ------
    Internal
        The path breaks one of these rules: a fault of the planner, which must not reach a vehicle.
    """
    if not path.is_simple:
        raise Internal("the planned path crosses itself", "path")
    if path.length > request.length_m:
        raise Internal(f"the planned path is {path.length:.1f} m long, of {request.length_m:.1f} m", "path")
    if stray := strays(path, request.space.free, request.launch, request.recovery):
        place = stray[0].interpolate(0.5, normalized=True)
        raise Internal(
            f"the planned path leaves the free space for {sum(line.length for line in stray):.3f} m,"
            f" near ({place.x:.1f}, {place.y:.1f})",
            "path",
        )
