"""The replies of stages, checked against their requests before they are used.

A stage may be an old replica, a wrong one, or one that mixes its answers up. What it replies has to belong to the
request; and a path leaves only after it has been judged once more, on the mission's own water.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
import shapely
from msgspec import structs
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Place
from oxbow.contracts import (
    ASSIGN,
    CERTIFY,
    CONTOUR,
    DECOMPOSE,
    PATH,
    Assignment,
    AssignRequest,
    Call,
    Certificate,
    CertifyRequest,
    ContourRequest,
    DecomposeRequest,
    Decomposition,
    Endpoint,
    Fault,
    FreeSpace,
    Message,
    PathPlan,
    PathRequest,
    Role,
    Rule,
    Share,
    Vehicle,
)
from oxbow.errors import Internal
from oxbow.geometry.conformance import SHORE_TOLERANCE_M, Shore, strays
from oxbow.geometry.frame import Frame
from oxbow.geometry.lanes import legs_length_m
from oxbow.geometry.sweep import from_sweep
from oxbow.site.fleet import VehiclePlan
from oxbow.tolerances import DISTANCE_ROUNDING, ROUNDING_M
from oxbow.wire import codec

__all__ = ["CheckedCall", "require_faultless", "require_fit_to_follow"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

EXACT_M = 10 * ROUNDING_M
"""Places that a reply takes over from its request may differ by this much."""


class CheckedCall:
    """A call whose replies belong to their requests.

    Raises
    ------
    Internal
        A reply does not; the error names the stage.
    """

    def __init__(self, call: Call) -> None:
        self.call = call

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        reply = self.call(endpoint, request, part=part)
        for fault in CHECKS[endpoint.stage](request, reply):
            raise Internal(
                f"sent a reply that does not match the request: {fault}; nothing is planned on it", endpoint.stage
            )
        return reply


def require_fit_to_follow(shore: Shore, frame: Frame, plans: Sequence[VehiclePlan]) -> None:
    """Judge paths on the mission's own water, whatever is certified of them.

    Parameters
    ----------
    shore
        The water, with the distance to keep from its shore.
    frame
        The site's plane, to give places in degrees.
    plans
        What to judge.

    Raises
    ------
    Internal
        A path breaks a rule; see `require_faultless`.
    """
    for number, plan in enumerate(plans):
        vehicle = plan.member.vehicle
        faults = shore.conduct(plan.path, vehicle.start, vehicle.recovery).faults
        require_faultless([structs.replace(fault, track=number) for fault in faults], frame, plans)


def require_faultless(faults: Iterable[Fault], frame: Frame, plans: Sequence[VehiclePlan]) -> None:
    """Refuse to hand out paths with a known fault.

    Parameters
    ----------
    faults
        What is wrong; the `track` of each is an index into `plans`.
    frame
        The site's plane, to give places in degrees.
    plans
        The plans that the paths belong to.

    Raises
    ------
    Internal
        A path crosses itself, leaves the water, or comes nearer to the shore than its launch and recovery points
        make necessary. The error names where, how far, and what may help.
    """
    for fault in faults:
        plan = plans[fault.track]
        # A way home may cross the way out where hot spots are treated between them.
        if fault.rule is not Rule.CROSSING or not plan.hot_spots:
            raise Internal(_unfit(fault, frame), plan.member.with_name("path"))


def _unfit(fault: Fault, frame: Frame) -> str:
    long, lat = frame.to_degrees(np.array([fault.place]))[0]
    place = f"at lat {lat:.7f}, long {long:.7f}"
    leg = f" on its {fault.leg} leg" if fault.leg else ""
    what = {
        Rule.CROSSING: f"crosses itself {fault.count} times, first {place}",
        Rule.OUTSIDE: f"runs {fault.metres:.2f} m outside the water{leg}, {place}",
        Rule.UNSAFE: f"runs {fault.metres:.2f} m nearer to the shore than Safety{leg}, {place}",
    }[fault.rule]
    return (
        f"{what}, and is not handed out; another --method or --seed, or a {fault.leg or 'launch'} point in open"
        " water, may help"
    )


# --------------------------------------------------------------------------- what is wrong with a reply


def _free_space_faults(request: ContourRequest, reply: FreeSpace) -> Iterator[str]:
    if not _lies_in(reply.free, request.outline):
        yield "the free space leaves the outline"
    inland = [zone.representative_point() for zone in request.zones]
    if shapely.contains(reply.free, inland).any():
        yield "the free space holds a forbidden zone"


def _cell_faults(request: DecomposeRequest, reply: Decomposition) -> Iterator[str]:
    chains = [chain for cell in reply.cells for chain in (cell.floor, cell.ceiling)]
    if chains and not _are_in(from_sweep(np.vstack(chains), reply.heading_rad), request.free):
        yield "cells lie outside the free space"


def _path_faults(request: PathRequest, reply: PathPlan) -> Iterator[str]:
    yield from _way_faults(reply.path, request.launch, request.recovery, request.length_m)
    allowed: BaseGeometry = request.space.free
    if request.approach is not None:
        # Legs to a share run through the free water around it; they keep to it as nearly as they are judged.
        allowed = shapely.union_all([allowed, *request.approach.water]).buffer(SHORE_TOLERANCE_M)
    if stray := strays(reply.path, allowed, request.launch, request.recovery):
        place = stray[0].interpolate(0.5, normalized=True)
        yield f"the path leaves the free space, as at ({place.x:.1f}, {place.y:.1f}), and not as a leg"


def _assignment_faults(request: AssignRequest, reply: Assignment) -> Iterator[str]:
    yield from _share_faults(request, reply)
    vehicles = {vehicle.name: vehicle for vehicle in request.vehicles}
    spots = {spot.name for spot in request.hot_spots}
    for sortie in (*reply.sorties, *reply.further):
        vehicle = vehicles.get(sortie.vehicle)
        if vehicle is None or not spots.issuperset(sortie.hot_spots):
            yield f"a sortie of {sortie.vehicle!r} over {', '.join(sortie.hot_spots)} was not asked for"
        else:
            yield from _way_faults(sortie.path, vehicle.start, vehicle.recovery, vehicle.length_m)


def _share_faults(request: AssignRequest, reply: Assignment) -> Iterator[str]:
    masters = {vehicle.name: vehicle for vehicle in request.vehicles if vehicle.role is Role.MASTER}
    asked = sorted(masters) if request.share_free else []
    given = sorted(share.vehicle for share in reply.shares)
    if given != asked:
        yield f"shares are those of {', '.join(given) or 'nobody'}, not of {', '.join(asked) or 'nobody'}"
        return
    for share in reply.shares:
        if not _are_in(shapely.get_coordinates(share.area), request.free):
            yield f"the share of {share.vehicle!r} leaves the free space"
        yield from _approach_faults(share, masters[share.vehicle], request.free)
    if reply.shares:
        yield from _division_faults(request, reply)


def _division_faults(request: AssignRequest, reply: Assignment) -> Iterator[str]:
    """Whether shares, with what is dropped, make up the free space, and none lies upon another."""
    areas = [share.area for share in reply.shares]
    shared_m2, covered_m2 = sum(area.area for area in areas), shapely.union_all(areas).area
    dropped_m2 = sum(part.area_m2 for part in reply.dropped)
    # Rounding moves rims by no more than places may differ.
    exact_m2 = EXACT_M * sum(area.length for area in areas)
    if shared_m2 - covered_m2 > exact_m2:
        yield f"shares overlap by {shared_m2 - covered_m2:.3g} m2"
    elif (missing_m2 := request.free.area - covered_m2 - dropped_m2) > exact_m2:
        yield f"shares leave {missing_m2:.3g} m2 of the free space to nobody"


def _approach_faults(share: Share, vehicle: Vehicle, free: Polygon) -> Iterator[str]:
    """What is wrong with the ends and the length of the legs; where they run is judged with the path."""
    approach, whose = share.approach, f"approach of {share.vehicle!r}"
    for place, gate, leg in (
        (vehicle.start, approach.launch, approach.out),
        (vehicle.recovery, approach.recovery, approach.home),
    ):
        if leg is None:
            begin_m, end_m = 0.0, math.dist(place, gate)
            # From ashore, the way to the free space would have to be found again to know where it enters.
            if free.contains(Point(place)) and not shapely.dwithin(share.area, Point(place), EXACT_M):
                yield f"no leg leads {share.vehicle!r} from its place to its share"
        else:
            begin_m, end_m = map(math.dist, (leg.line.coords[0], leg.line.coords[-1]), (place, gate))
            if not shapely.dwithin(share.area, Point(gate), EXACT_M):
                yield f"the {whose} has a gate that is not at the share"
        if max(begin_m, end_m) > EXACT_M:
            yield f"the {whose} begins {begin_m:.3g} m from its place and ends {end_m:.3g} m from its gate"
    legs_m = legs_length_m(approach.out, approach.home, approach.apart_m)
    if not math.isclose(approach.legs_m, legs_m, rel_tol=DISTANCE_ROUNDING, abs_tol=EXACT_M):
        yield f"the {whose} takes {approach.legs_m:.1f} m, but its legs {legs_m:.1f} m"
    if legs_m >= vehicle.length_m:
        yield f"the {whose} takes {legs_m:.1f} m, of {vehicle.length_m:.1f} m"


def _certificate_faults(request: CertifyRequest, reply: Certificate) -> Iterator[str]:
    if reply.request_digest != codec.digest(request):
        yield "the certificate is that of other paths or of another water"


def _way_faults(path: LineString, start: Place, end: Place, length_m: float) -> Iterator[str]:
    off_m = np.hypot(*(shapely.get_coordinates(path)[[0, -1]] - np.array([start, end])).T)
    if off_m.max() > EXACT_M:
        yield f"a path begins {off_m[0]:.3g} m from its start and ends {off_m[1]:.3g} m from its recovery"
    if path.length > length_m * (1.0 + DISTANCE_ROUNDING):
        yield f"a path is {path.length:.1f} m long, of {length_m:.1f} m"


def _lies_in(area: Polygon, other: Polygon) -> bool:
    """Whether an area lies in another without holes; what rounding adds to it aside."""
    return _are_in(shapely.get_coordinates(area), other)


def _are_in(places: np.ndarray, area: Polygon) -> bool:
    shapely.prepare(area)
    # Distances cost most, so only places outside are measured: rounding leaves few of them.
    out = places[~shapely.contains_xy(area, places)]
    return bool(shapely.dwithin(area, shapely.points(out), EXACT_M).all())


Check = Callable[[Any, Any], Iterable[str]]

CHECKS: dict[str, Check] = {
    CONTOUR.stage: _free_space_faults,
    DECOMPOSE.stage: _cell_faults,
    PATH.stage: _path_faults,
    ASSIGN.stage: _assignment_faults,
    CERTIFY.stage: _certificate_faults,
}
