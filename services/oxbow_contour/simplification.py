"""Contours simplified together, so that none crosses itself or another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.rings import rings_of
from oxbow.tolerances import DISTANCE_ROUNDING
from oxbow_contour.strips import deviations, strip_ends

__all__ = ["Simplified", "simplify"]


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

    Returns
    -------
    Simplified
        Valid parts, one for each polygon.
    """
    # A repeated point would make an edge of length 0, by which `deviations` divides.
    rings = rings_of(shapely.remove_repeated_points(np.array(water, dtype=object)))
    sizes = np.array([len(ring) for ring in rings])
    starts = np.cumsum(sizes) - sizes
    points = np.concatenate(rings)
    ends = [strip_ends(ring, tolerance_m) + start for ring, start in zip(rings, starts, strict=True)]
    is_kept = np.zeros(len(points), dtype=bool)
    is_kept[np.concatenate(ends)] = True
    closing = starts + sizes - 1
    counts = [1 + len(part.interiors) for part in water]

    # Ends: each round keeps at least one more point, and with all points kept the contours are the true ones.
    while True:
        simple = [points[s : c + 1][is_kept[s : c + 1]] for s, c in zip(starts, closing, strict=True)]
        parts = [Polygon(group[0], group[1:]) for group in _grouped(simple, counts)]
        # Of a sound one no two edges meet: no need to look for them.
        is_sound = len(parts) == 1 and bool(shapely.is_valid(parts[0]))
        edges = _Edges.between(points, is_kept, starts, closing)
        faulty = edges.is_wide(tolerance_m)
        if not faulty.any() and not is_sound:
            faulty = edges.is_met()
        if not faulty.any():
            break
        # In the middle by number, so that a strip of n points is split log2 n times at most.
        is_kept[edges.middle[faulty]] = True

    return Simplified(
        parts=tuple(parts) if is_sound else tuple(_without_islands(part) for part in parts),
        tolerance_m=tolerance_m,
        points_in=len(points) - len(rings),
        points_out=int(is_kept.sum()) - len(rings),
    )


@dataclass(frozen=True)
class _Edges:
    """Simplified edges, each from point `first` to point `last`, and `follower`, the next edge of its ring."""

    points: FloatArray
    first: Indices
    last: Indices
    follower: Indices

    @classmethod
    def between(cls, points: FloatArray, is_kept: Mask, starts: Indices, closing: Indices) -> _Edges:
        """The edges between kept points; rings go from point `starts` to point `closing`."""
        kept = np.flatnonzero(is_kept)
        is_edge = ~np.isin(kept[:-1], closing)
        first, last = kept[:-1][is_edge], kept[1:][is_edge]
        follower = np.arange(1, len(first) + 1)
        follower[np.searchsorted(last, closing)] = np.searchsorted(first, starts)
        return cls(points, first, last, follower)

    @property
    def middle(self) -> Indices:
        return (self.first + self.last) // 2

    @property
    def is_strip(self) -> Mask:
        """Whether an edge stands for more than one edge of the true contour."""
        return self.last - self.first > 1

    def is_wide(self, tolerance_m: float) -> Mask:
        """Whether an edge is a strip that does not hold its points."""
        return self.is_strip & (
            deviations(self.points, self.first, self.last) > tolerance_m * (1 + DISTANCE_ROUNDING)
        )

    def is_met(self) -> Mask:
        """Whether an edge is a strip that meets another edge than its neighbours."""
        strips = np.flatnonzero(self.is_strip)
        lines = np.asarray(
            shapely.linestrings(np.stack([self.points[self.first], self.points[self.last]], axis=1))
        )
        mine, other = STRtree(lines).query(lines[strips], predicate="intersects")
        mine = strips[mine]
        # Neighbours share a vertex, and so always meet.
        is_foreign = (mine != other) & (self.follower[mine] != other) & (self.follower[other] != mine)
        met = np.zeros(len(lines), dtype=np.bool_)
        met[mine[is_foreign]] = True
        return met


def _grouped(rings: list[FloatArray], counts: list[int]) -> list[list[FloatArray]]:
    stops = np.cumsum(counts)
    return [rings[stop - count : stop] for count, stop in zip(counts, stops, strict=True)]


def _without_islands(polygon: Polygon) -> Polygon | MultiPolygon:
    """What the exterior ring surrounds and no other ring does.

    An island nearer to the shore than the tolerance may have changed sides without crossing it.
    """
    if shapely.is_valid(polygon):
        return polygon
    rest = Polygon(polygon.exterior).difference(shapely.union_all([Polygon(ring) for ring in polygon.interiors]))
    return MultiPolygon([part for part in shapely.get_parts(rest) if isinstance(part, Polygon)])
