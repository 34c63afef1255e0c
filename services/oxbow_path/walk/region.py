"""The walk round a tree: a region without holes whose boundary is the path.

Dilate a connected set of lines inside the free space by half a spacing, clip it by the free space, and open
whatever holes remain: the boundary of what results is one closed curve, inside, that never crosses itself, by
construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import LinearRing, LineString, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices
from oxbow_path.walk.probe import Probe, all_within_reach

__all__ = ["Brush", "Circuit", "Walk", "clear_of_land", "dilated_circuit", "largest", "simply_connected"]

CORE = 0.5
"""Half width of a band in narrows, as a share of its half width in the open."""

MANY_CORNERS = 1_000
"""Lines of more corners are simplified before they are dilated: ways along narrow channels have so many that GEOS
would take minutes."""

DETAIL = 0.01
"""How far such a line may be off then, as a share of the half width."""

LEAST_LINE_M = 1e-9
"""Shorter lines have no direction to be dilated across."""

MITRE = 1.5
"""Corners of bands are sharp up to this ratio, for few waypoints."""

NARROWINGS = 8
"""How often cuts are halved in width before the holes that remain are enclosed."""

AREA_TOLERANCE = 1e-6
"""Share of a region's area that rounding may lose."""


@dataclass(frozen=True)
class Circuit:
    """The tree that the path walks round: transects, and the links that join them into one piece."""

    transects: tuple[LineString, ...]
    links: tuple[LineString, ...]


@dataclass(frozen=True)
class Walk:
    """A simply connected region and how it became so."""

    region: Polygon
    cuts: tuple[LineString, ...] = ()
    enclosed: tuple[Polygon, ...] = ()

    @property
    def ring(self) -> LinearRing:
        """The closed path: the region's boundary."""
        return self.region.exterior


def largest(geometry: BaseGeometry) -> Polygon:
    """The largest polygon of a geometry."""
    parts = shapely.get_parts(geometry)
    polygons = parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON]
    return Polygon() if len(polygons) == 0 else polygons[np.argmax(shapely.area(polygons))]


@dataclass(frozen=True)
class Brush:
    """Turns lines into bands inside the free space.

    A band is `half_width_m` wide on either side where that keeps `margin_m` from the shore: water so near to it is
    covered from there, and the path need not follow every bend. In narrows only the core of the band remains, so
    that the path runs out and back near their middle, and what was connected stays so.
    """

    free: Polygon
    half_width_m: float
    margin_m: float

    @cached_property
    def _roomy(self) -> BaseGeometry:
        return self.free.buffer(-self.margin_m)

    def bands(self, lines: Sequence[LineString], *, flat: bool = False) -> BaseGeometry:
        """The bands of some lines.

        Parameters
        ----------
        lines
            In the free space; those shorter than `LEAST_LINE_M` have no band.
        flat
            Whether bands end where their lines end; otherwise they reach half their width beyond.

        Returns
        -------
        BaseGeometry
            The union of all bands, inside the free space; empty without lines.
        """
        # Two widths of each line; the narrow one is kept wherever the wide one would touch the margin along the
        # shore.
        wide, core = (
            shapely.union_all(_dilations(lines, width_m, flat=flat))
            for width_m in (self.half_width_m, CORE * self.half_width_m)
        )
        return wide.intersection(self._roomy).union(core.intersection(self.free))


def _dilations(lines: Sequence[LineString], width_m: float, *, flat: bool) -> list[BaseGeometry]:
    directed = np.array([line for line in lines if line.length > LEAST_LINE_M], dtype=object)
    many = shapely.get_num_coordinates(directed) > MANY_CORNERS
    directed[many] = shapely.simplify(directed[many], DETAIL * width_m)
    # GEOS raises the flags of a division by zero where it mitres parallel segments, and then copes with it.
    with np.errstate(divide="ignore", invalid="ignore"):
        dilations = shapely.buffer(
            directed,
            width_m,
            cap_style="flat" if flat else "square",
            join_style="mitre",
            mitre_limit=MITRE,
        )
    return list(dilations)


def dilated_circuit(circuit: Circuit, brush: Brush) -> Polygon:
    """The circuit's lines, dilated: transects end where they end, links reach over what they join.

    Parameters
    ----------
    circuit
        Lines that are connected.
    brush
        How wide the bands are, and where.

    Returns
    -------
    Polygon
        The largest piece, perhaps with holes.
    """
    return largest(brush.bands(circuit.transects, flat=True).union(brush.bands(circuit.links)))


def clear_of_land(region: BaseGeometry, free: Polygon) -> Polygon:
    """The largest part of a region in the free space, with its holes filled: its boundary touches no land.

    What a region encloses may be land, and a cut through it may reach that land; it then follows the shore.

    Parameters
    ----------
    region
        May reach beyond the free space.
    free
        The free space.

    Returns
    -------
    Polygon
        Without holes; empty where the region meets no water.
    """
    return Polygon(largest(region.intersection(free)).exterior)


def simply_connected(region: Polygon, free: Polygon, probe: Probe, *, cut_width_m: float, reach_m: float) -> Walk:
    """Rid a region of its holes.

    A hole whose water lies within `reach_m` of the remaining boundary is enclosed: its own ring is not worth
    travelling. Every other hole is opened to the outside by a cut across the region where it is narrowest, so
    that the path runs round it too.

    Parameters
    ----------
    region
        A region in one piece, perhaps with holes.
    free
        The free space, to which the walk is clipped.
    probe
        The places that have to be within reach of the boundary.
    cut_width_m
        Width of the cuts; narrower where one this wide would cut off more than itself.
    reach_m
        How far water may be from the path.

    Returns
    -------
    Walk
        The region without holes, the cuts, and the holes that were enclosed.
    """
    if not region.interiors:
        return Walk(clear_of_land(region, free))
    kept, enclosed = _enclose(region, probe, reach_m)
    filled = Polygon(region.exterior, kept)
    cuts = _cuts(filled)
    opened = _open(filled, cuts, cut_width_m) if cuts else filled
    return Walk(clear_of_land(opened, free), tuple(cuts), tuple(enclosed))


def _enclose(region: Polygon, probe: Probe, reach_m: float) -> tuple[list[LinearRing], list[Polygon]]:
    """Split the holes into those to keep and those that the rest of the boundary covers well enough."""
    rings = [region.exterior, *region.interiors]
    steps, owner = probe.steps(rings)
    # Sorted by their first coordinate, those near a hole are a stretch of all.
    order = np.argsort(steps[:, 0], kind="stable")
    steps, owner = steps[order], owner[order]
    kept = np.ones(len(rings), dtype=bool)
    holes = [Polygon(ring) for ring in rings]
    # Smallest first, for their rings are the least worth travelling; what is enclosed covers nothing from then on.
    for index in sorted(range(1, len(rings)), key=lambda i: holes[i].area):
        served = probe.points[probe.within(holes[index].buffer(reach_m))]
        # A place to cover lies within reach of the hole, and the step that covers it within reach of the place.
        near = _near(steps, holes[index], 2 * reach_m)
        rest = near[(owner[near] != index) & kept[owner[near]]]
        kept[index] = not all_within_reach(served, steps[rest], reach_m)
    return (
        [ring for ring, keep in zip(rings[1:], kept[1:], strict=True) if keep],
        [hole for hole, keep in zip(holes[1:], kept[1:], strict=True) if not keep],
    )


def _near(points: FloatArray, area: Polygon, margin_m: float) -> Indices:
    """Which points, sorted by their first coordinate, lie in the box round an area, widened by a margin."""
    x0, y0, x1, y1 = area.bounds
    first, last = np.searchsorted(points[:, 0], [x0 - margin_m, x1 + margin_m])
    y = points[first:last, 1]
    return np.asarray(first + np.flatnonzero((y >= y0 - margin_m) & (y <= y1 + margin_m)))


def _cuts(region: Polygon) -> list[LineString]:
    """The shortest segments that join every hole to the exterior, by Prim's rule.

    The globally shortest segment from the opened rings to another one crosses no third ring, or that one would be
    nearer: so it lies inside the region.
    """
    holes = np.asarray(region.interiors)
    if len(holes) == 0:
        return []
    nearest = np.full(len(holes), region.exterior)
    distance = shapely.distance(holes, nearest)
    opened = np.zeros(len(holes), dtype=bool)
    cuts = []
    for _ in range(len(holes)):
        index = int(np.argmin(np.where(opened, np.inf, distance)))
        opened[index] = True
        cuts.append(shapely.shortest_line(nearest[index], holes[index]))
        closer = shapely.distance(holes, holes[index])
        update = closer < distance
        nearest[update] = holes[index]
        distance = np.minimum(distance, closer)
    return cuts


def _open(region: Polygon, cuts: Sequence[LineString], width_m: float) -> Polygon:
    """Take the cuts out of the region, narrower where a wide one would cut off more than itself.

    Should a hole remain all the same, it is enclosed: the exterior alone is a path too.
    """
    for _ in range(NARROWINGS):
        slits = shapely.union_all(shapely.buffer(np.asarray(cuts), width_m / 2))
        opened = largest(region.difference(slits))
        # A cut that removes more area than it has parts something off, which is then lost with `largest`.
        if not opened.interiors and region.area - opened.area <= slits.area + AREA_TOLERANCE * region.area:
            return opened
        width_m /= 2
    return Polygon(opened.exterior)
