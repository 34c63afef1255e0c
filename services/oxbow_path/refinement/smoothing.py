"""Rounded corners: a cubic B-spline that stays inside and simple."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Polygon

from oxbow.arrays import FloatArray
from oxbow_path.refinement.guard import Guard
from oxbow_path.refinement.polyline import Polyline

__all__ = ["smoothed_path"]

CONTROL_PITCH = 0.2
"""Distance of the spline's control points at most, in spacings: the size of the corners' roundings."""

PIECES = 3
"""Straight pieces that stand for the spline between two control points."""

DETAIL = 0.005
"""Waypoints that move the path by less than this, in spacings, are left out."""


def smoothed_path(path: Polyline, free: Polygon, spacing_m: float) -> LineString:
    """Round a path's corners.

    The waypoints, with more between them where they are far apart, are the control points of a uniform cubic
    B-spline. Rendas and Li 2016, section 1.2.1.4, propose a cubic spline through the waypoints; that is longer
    than the path, and swings out beside its corners. A B-spline is never longer than its control polygon. Where it
    would leave the free space, or meet the path elsewhere, the corner keeps nearer to what it was.

    Parameters
    ----------
    path
        Simple, and inside `free` except for its legs, which stay as they are.
    free
        The free space.
    spacing_m
        The nominal spacing, which scales the roundings and the detail that is left out.

    Returns
    -------
    LineString
        Simple and inside, as the path is; legs are left as they are.
    """
    # Rigid segments get control points as all others do, so that the corners at their ends are rounded too.
    loose = Polyline(path.nodes, path.pinned, path.legs, np.zeros_like(path.rigid))
    control = loose.divided(CONTROL_PITCH * spacing_m)
    fine = control.subdivided(PIECES)
    guard = Guard.of(free, fine, spacing_m)
    # Moved from the corners to the curve under the guard: where the whole way is not sound, part of it is taken.
    rounded = guard.moved(fine, _spline(control.nodes, PIECES))
    return guard.thinned(rounded, _needless(rounded, DETAIL * spacing_m)).line


def _spline(control: FloatArray, pieces: int) -> FloatArray:
    """Points of a uniform cubic B-spline, `pieces` per span, from the first control point to the last."""
    # Control points reflected in the ends make the curve begin and end there.
    ends = np.vstack([2 * control[0] - control[1], control, 2 * control[-1] - control[-2]])
    t = (np.arange(pieces) / pieces)[:, None]
    weights = np.hstack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6.0
    spans = np.stack([ends[i : len(ends) - 3 + i] for i in range(4)])
    points = np.einsum("pw,wnc->npc", weights, spans).reshape(-1, 2)
    return np.vstack([points, control[-1:]])


def _needless(path: Polyline, detail_m: float) -> np.typing.NDArray[np.bool_]:
    """The nodes (n,) that simplification by `detail_m` (Douglas and Peucker 1973) leaves out, but pinned ones."""
    kept = shapely.get_coordinates(path.line.simplify(detail_m, preserve_topology=False))
    keys = {tuple(node) for node in kept.tolist()}
    needless = np.array([tuple(node) not in keys for node in path.nodes.tolist()])
    return np.asarray(needless & ~path.pinned)
