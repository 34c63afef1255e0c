"""A path for one pattern: the walk round a tree, its gaps, its legs (Rendas and Li 2016, section 1.2.1.1)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import Cell
from oxbow.geometry.route.gate_routes import Routes
from oxbow.tolerances import ROUNDING_M
from oxbow_path.walk.access import Access
from oxbow_path.walk.gaps import branch_to, reach_gaps
from oxbow_path.walk.legs import Passable, is_plainly_simple, path_with_legs
from oxbow_path.walk.probe import Probe
from oxbow_path.walk.region import Brush, Circuit, Walk, clear_of_land, dilated_circuit, largest, simply_connected

__all__ = [
    "Pattern",
    "Trial",
    "Waters",
    "grown_to_entries",
    "touches_entries",
    "trial_with_legs",
    "walk_round_tree",
]

TRIM = 0.8
"""Share of the tolerable distance to the shore that a transect stops short of it."""

CUT = 0.25
"""Width of a cut through the region, in spacings."""

START = 0.1
"""Radius of the region that a path without transects grows from, in nominal spacings."""

SMOOTHINGS = 8
"""How often a ring that all but touches itself is smoothed, each time a quarter as far as before."""

STRAIGHTENING = 0.05
"""How far the walk may be moved to straighten it, in spacings."""


@dataclass(frozen=True)
class Waters:
    """All that stays the same while the spacing is sought; geometry in the sweep frame.

    `spacing_m` is the nominal spacing, area / length.
    """

    spacing_m: float
    cells: tuple[Cell, ...]
    free: Polygon
    passable: Passable
    probe: Probe
    routes: Routes
    launch: Access
    recovery: Access

    @property
    def widest_m(self) -> float:
        """A spacing at which the water has no transect, and no gap."""
        x0, y0, x1, y1 = self.free.bounds
        return 2 * math.hypot(x1 - x0, y1 - y0)

    @property
    def entries(self) -> tuple[Point, Point]:
        """Where the legs from launch and to recovery meet the free space."""
        return self.launch.entry, self.recovery.entry


@dataclass(frozen=True)
class Pattern:
    """What is tried: the spacing of the path's parallel legs and how far water may stay from the path.

    `reach` is the largest distance from a point of the water to the path that is left alone, as a multiple of
    half the spacing; `phase` shifts the transects by a share of their pitch.
    """

    spacing_m: float
    reach: float = 1.5
    phase: float = 0.25

    @property
    def half_width_m(self) -> float:
        """How far a leg stands from the line that it runs beside: half the spacing."""
        return self.spacing_m / 2

    @property
    def reach_m(self) -> float:
        """How far water may stay from the path."""
        return self.reach * self.half_width_m

    @property
    def cut_m(self) -> float:
        """Width of a cut through the region."""
        return CUT * self.spacing_m

    @property
    def trim_m(self) -> float:
        """How far short of the shore a transect stops, so that the shore between two stays within reach."""
        return TRIM * self.half_width_m * min(1.0, math.sqrt(self.reach**2 - 1.0))


@dataclass(frozen=True)
class Trial:
    """A path for one pattern, and what led to it; geometry in the sweep frame."""

    pattern: Pattern
    circuit: Circuit
    walk: Walk
    path: LineString

    @property
    def length_m(self) -> float:
        """The length of the path, legs included."""
        return float(self.path.length)


def walk_round_tree(waters: Waters, pattern: Pattern, circuit: Circuit) -> Trial:
    """Walk round a tree of lines, and round branches to what is out of reach of it; from launch to recovery.

    Parameters
    ----------
    waters
        The water, and how launch and recovery points are reached.
    pattern
        The spacing of the legs, and how far water may be from them.
    circuit
        The tree; without transects, the walk starts from the launch point's entry alone.

    Returns
    -------
    Trial
        Simple, and inside the free space except for its legs, whatever its length.
    """
    # The brush draws bands half a spacing to either side of the tree's lines: the walk runs along their edge.
    brush = Brush(waters.free, pattern.half_width_m, pattern.trim_m)
    connected = partial(
        simply_connected, free=waters.free, probe=waters.probe, cut_width_m=pattern.cut_m, reach_m=pattern.reach_m
    )
    # The tree's region, grown to both entries, rid of holes, grown into gaps: in this order, since each step
    # relies on what the one before has made sure of.
    walk = connected(grown_to_entries(_started(waters, circuit, brush), waters, brush))
    walk = reach_gaps(walk, brush, waters.probe, waters.routes, reach_m=pattern.reach_m, cut_width_m=pattern.cut_m)
    # Straightening may open holes and part an entry from the region: both are mended once more.
    region = _straightened(walk.region, waters, STRAIGHTENING * pattern.spacing_m)
    region = connected(grown_to_entries(region, waters, brush)).region
    # A cut may have parted an entry from the region. What the region encloses once grown back to it is filled.
    if not touches_entries(region, waters):
        region = Polygon(grown_to_entries(region, waters, brush).exterior)
    return trial_with_legs(waters, pattern, circuit, Walk(region, walk.cuts, walk.enclosed))


def trial_with_legs(waters: Waters, pattern: Pattern, circuit: Circuit, walk: Walk) -> Trial:
    """A walk that touches both entries, with its legs; smoothed first where its ring all but touches itself.

    Parameters
    ----------
    waters
        The water, and how launch and recovery points are reached.
    pattern
        The spacing that scales the smoothing and the ring's opening.
    circuit
        The lines that the walk goes round: kept for display.
    walk
        A simply connected region whose boundary becomes the path.

    Returns
    -------
    Trial
        With the path from launch to recovery.
    """
    width_m = STRAIGHTENING * pattern.spacing_m
    for _ in range(SMOOTHINGS):
        if is_plainly_simple(LineString(walk.region.exterior)):
            break
        walk = Walk(_smoothed(walk.region, waters, width_m), walk.cuts, walk.enclosed)
        width_m /= 4
    # A ring that touches itself even now makes no simple path with any legs: that raises.
    path = path_with_legs(
        walk.region,
        waters.launch,
        waters.recovery,
        waters.passable,
        opening_m=pattern.cut_m,
        detail_m=pattern.half_width_m,
    )
    return Trial(pattern, circuit, walk, path)


def _smoothed(region: Polygon, waters: Waters, width_m: float) -> Polygon:
    """The region without gaps and necks narrower than twice `width_m`; as it was, if nothing else is left."""
    smooth = clear_of_land(region.buffer(width_m).buffer(-2 * width_m).buffer(width_m), waters.free)
    if smooth.is_empty:
        return region
    return Polygon(grown_to_entries(smooth, waters, Brush(waters.free, width_m, 0.0)).exterior)


def _started(waters: Waters, circuit: Circuit, brush: Brush) -> Polygon:
    """The circuit's region; water too narrow for any transect starts from the launch point's entry."""
    if circuit.transects:
        return dilated_circuit(circuit, brush)
    radius_m = min(brush.half_width_m, START * waters.spacing_m)
    return largest(waters.launch.entry.buffer(radius_m).intersection(waters.free))


def _straightened(region: Polygon, waters: Waters, tolerance_m: float) -> Polygon:
    """The region with fewer vertices, still inside the free space, and unchanged near the entries."""
    # Simplified lines may cut corners over land: what leaves the free space is taken off again.
    simple = region.simplify(tolerance_m).intersection(waters.free)
    kept = shapely.union_all([entry.buffer(4 * tolerance_m) for entry in waters.entries])
    return clear_of_land(simple.union(region.intersection(kept)), waters.free)


def grown_to_entries(
    region: Polygon, waters: Waters, brush: Brush, *, cleaned: Callable[[BaseGeometry], Polygon] = largest
) -> Polygon:
    """The region grown by bands to the launch and recovery points' entries that it does not touch.

    Parameters
    ----------
    region
        The walk's region.
    waters
        The entries, and the ways to them.
    brush
        Draws the bands.
    cleaned
        Makes one polygon of the region and a band.

    Returns
    -------
    Polygon
        As it was, where it touches both entries.
    """
    for entry in waters.entries:
        if not shapely.dwithin(region, entry, ROUNDING_M):
            goals = waters.routes.goals_in(region)
            place = shapely.get_coordinates(entry)[0]
            branch = branch_to(place, region, waters.routes, goals, brush.half_width_m)
            region = cleaned(region.union(brush.bands([branch])))
    return region


def touches_entries(region: Polygon, waters: Waters) -> bool:
    """Whether the legs can join the region where they end.

    Parameters
    ----------
    region
        The walk's region.
    waters
        The entries of launch and recovery points.

    Returns
    -------
    bool
        True for both entries, to within rounding.
    """
    return all(shapely.dwithin(region, entry, ROUNDING_M) for entry in waters.entries)
