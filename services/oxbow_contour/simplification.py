"""Contours simplified together, so that none crosses itself or another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from oxbow.contracts import FloatArray
from oxbow_contour.rings import rings_of
from oxbow_contour.strips import IndexArray, deviations, strip_ends

__all__ = ["Simplified", "simplify"]

ROUNDING = 1e-9  # relative


@dataclass(frozen=True)
class Simplified:
    """Simplified water, and the bound on how far its contours are from the true ones.

    `parts` has one entry for each true polygon; `points_in` and `points_out` count vertices of the contours.
    """

    parts: tuple[Polygon | MultiPolygon, ...]
    tolerance_m: float
    points_in: int
    points_out: int

    @property
    def compression(self) -> float:
        """Points of the true contours for each point of the simplified ones."""
        return self.points_in / self.points_out

    @property
    def extent_m(self) -> float:
        """The largest coordinate, to which rounding is relative."""
        return float(np.abs(shapely.total_bounds(self.parts)).max())


def simplify(water: Sequence[Polygon], tolerance_m: float) -> Simplified:
    """Simplify the contours of polygons, all together.

    Each contour goes through the linear pass of `strip_ends`. Where two edges then meet, the strips among them
    are split in the middle, and so are strips that no longer hold their points, until none is left: at the
    latest with the true contours. (Saalfeld 1999 splits in the same spirit.)

    Parameters
    ----------
    water
        Valid polygons with disjoint interiors, in metres.
    tolerance_m
        Half width of the strips: no point of a contour is farther than this from the edge that stands for it.
    """
    rings = rings_of(shapely.remove_repeated_points(np.array(water, dtype=object)))
    sizes = np.array([len(ring) for ring in rings])
    starts = np.cumsum(sizes) - sizes
    points = np.concatenate(rings)
    ends = [strip_ends(ring, tolerance_m) + start for ring, start in zip(rings, starts, strict=True)]
    is_kept = np.zeros(len(points), dtype=bool)
    is_kept[np.concatenate(ends)] = True
    closing = starts + sizes - 1

    while len(middles := _middles_of_faulty_strips(points, is_kept, starts, closing, tolerance_m)):
        is_kept[middles] = True

    simple = [points[s : c + 1][is_kept[s : c + 1]] for s, c in zip(starts, closing, strict=True)]
    counts = [1 + len(part.interiors) for part in water]
    return Simplified(
        parts=tuple(_polygon(group) for group in _grouped(simple, counts)),
        tolerance_m=tolerance_m,
        points_in=len(points) - len(rings),
        points_out=int(is_kept.sum()) - len(rings),
    )


def _middles_of_faulty_strips(
    points: FloatArray, is_kept: npt.NDArray[np.bool_], starts: IndexArray, closing: IndexArray, tolerance_m: float
) -> IndexArray:
    """The middle points of all strips that meet another edge, or do not hold their points."""
    kept = np.flatnonzero(is_kept)
    is_edge = ~np.isin(kept[:-1], closing)
    first, last = kept[:-1][is_edge], kept[1:][is_edge]
    strips = np.flatnonzero(last - first > 1)
    if not len(strips):
        return strips
    is_wide = deviations(points, first[strips], last[strips]) > tolerance_m * (1 + ROUNDING)
    edges = np.asarray(shapely.linestrings(np.stack([points[first], points[last]], axis=1)))
    mine, other = STRtree(edges).query(edges[strips], predicate="intersects")
    mine = strips[mine]
    follower = np.arange(1, len(edges) + 1)
    ring_first = np.searchsorted(first, starts)
    follower[np.searchsorted(last, closing)] = ring_first
    is_foreign = (mine != other) & (follower[mine] != other) & (follower[other] != mine)
    meets = np.zeros(len(edges), dtype=np.bool_)
    meets[mine[is_foreign]] = True
    faulty = strips[is_wide | meets[strips]]
    return (first[faulty] + last[faulty]) // 2


def _grouped(rings: list[FloatArray], counts: list[int]) -> list[list[FloatArray]]:
    stops = np.cumsum(counts)
    return [rings[stop - count : stop] for count, stop in zip(counts, stops, strict=True)]


def _polygon(rings: list[FloatArray]) -> Polygon | MultiPolygon:
    """What the first ring surrounds and no other does."""
    polygon = Polygon(rings[0], rings[1:])
    if polygon.is_valid:
        return polygon
    # An island nearer to the shore than the tolerance may have changed sides without crossing it.
    islands = shapely.union_all([Polygon(ring) for ring in rings[1:]])
    rest = Polygon(rings[0]).difference(islands)
    return MultiPolygon([part for part in shapely.get_parts(rest) if isinstance(part, Polygon)])
