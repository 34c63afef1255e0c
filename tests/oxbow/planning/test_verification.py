"""Replies that do not belong to their requests, and certificates that lie: none of them sends a boat anywhere."""

import json

import msgspec
import numpy as np
import pytest
import shapely
from shapely import LineString, affinity

from oxbow.contracts import ASSIGN, CERTIFY, CONTOUR, DECOMPOSE, PATH, Fault, Method, Rule
from oxbow.errors import Infeasible, Internal
from oxbow.geometry.frame import Frame
from oxbow.geometry.lanes import legs_length_m
from oxbow.mission.file import parse_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import plan_mission
from oxbow.wire import codec
from oxbow_cli.local import local_call

FRAME = Frame(lat=46.0, long=2.0)
OPTIONS = PlanOptions(method=Method.TRANSECT)
replace = msgspec.structs.replace


def at(x_m, y_m):
    long, lat = FRAME.to_degrees(np.array([(x_m, y_m)])).tolist()[0]
    return {"lat": lat, "long": long}


def pond(**changes):
    fields = {
        "MissionType": "map",
        "LaunchPoint": at(20, 20),
        "BoundingBox": [at(*corner) for corner in ((0, 0), (400, 0), (400, 200), (0, 200))],
        "ForbiddenZones": [[at(*corner) for corner in ((180, 80), (220, 80), (220, 120), (180, 120))]],
        "Safety": 5.0,
        "Master_length": 4000.0,
    }
    return parse_mission(json.dumps(fields | changes).encode())


FLEET = [{"Name": name, "Role": "master", "Length": 2000.0} for name in "ab"]


REPLIES = {}
"""What was replied to each request: stages are pure, and these tests ask them the same again and again."""


class Lying:
    """Stages of which some reply other than they should."""

    def __init__(self, **changed):
        self.changed = changed
        self.call = local_call()

    def __call__(self, endpoint, request, /, *, part=""):
        key = endpoint.stage, codec.digest(request)
        if key not in REPLIES:
            REPLIES[key] = self.call(endpoint, request, part=part)
        reply = REPLIES[key]
        change = self.changed.get(endpoint.stage)
        return reply if change is None else change(request, reply)


def moved(geometry, east_m):
    return affinity.translate(geometry, east_m, 0.0)


def ends_kept(path, change):
    xy = shapely.get_coordinates(path)
    xy[1:-1] = change(xy[1:-1])
    return LineString(xy)


def off_the_lake(_request, reply):
    return replace(reply, path=ends_kept(reply.path, lambda xy: xy * 0.5 + (0.0, 200.0)))


def through_the_island(_request, reply):
    xy = shapely.get_coordinates(reply.path)
    x, y = xy.mean(axis=0)
    return replace(reply, path=LineString([xy[0], (x, y - 5), (x + 170, y), (x, y + 5), xy[-1]]))


def over_most_of_the_island(_request, reply):
    """All that is checked of the free space itself is that it holds no zone's middle."""
    (island,) = reply.free.interiors
    middle = shapely.Polygon(island).centroid.buffer(2.0, quad_segs=2)
    return replace(reply, free=shapely.Polygon(reply.free.exterior, [middle.exterior]))


def praised(_request, reply):
    """A certificate that finds no fault, of the right request."""
    return replace(reply, faults=(), outside_m=0.0, unsafe_m=0.0, crossings=0, is_simple=True)


FALSE = {
    "free space off the lake": ({CONTOUR.stage: lambda _, r: replace(r, free=moved(r.free, 350.0))}, "contour"),
    "free space over an island": (
        {CONTOUR.stage: lambda _, r: replace(r, free=shapely.Polygon(r.free.exterior))},
        "contour",
    ),
    "cells of another lake": (
        {DECOMPOSE.stage: lambda q, _: local_call()(DECOMPOSE, replace(q, free=moved(q.free, 300.0)))},
        "decomposition",
    ),
    "path of another launch": ({PATH.stage: lambda _, r: replace(r, path=moved(r.path, 30.0))}, "path"),
    "path too long": (
        {PATH.stage: lambda q, r: replace(r, path=affinity.scale(r.path, 1.5, 1.5, origin=q.launch))},
        "path",
    ),
    "path off the lake": ({PATH.stage: off_the_lake}, "path"),
    "path off the lake, praised": ({PATH.stage: off_the_lake, CERTIFY.stage: praised}, "path"),
    "path through the island, praised": ({PATH.stage: through_the_island, CERTIFY.stage: praised}, "path"),
    "free space over most of an island, praised": (
        {CONTOUR.stage: over_most_of_the_island, CERTIFY.stage: praised},
        "path",
    ),
    "certificate of another path": (
        {CERTIFY.stage: lambda _, r: replace(r, request_digest="0" * 64)},
        "certificate",
    ),
}


@pytest.mark.parametrize(("changed", "where"), FALSE.values(), ids=FALSE.keys())
def test_a_false_stage_sends_no_boat_anywhere(changed, where):
    with pytest.raises(Internal) as raised:
        plan_mission(pond(), OPTIONS, call=Lying(**changed))
    assert raised.value.where == where


def of_the_far_one(change):
    """Stages of which `assignment` replies a changed share of `b`, which begins and ends away from it."""

    def lie(_request, reply):
        near, far = reply.shares
        assert not near.approach.has_legs
        assert far.approach.has_legs
        return replace(reply, shares=change(near, far))

    return Lying(**{ASSIGN.stage: lie})


def approached(share, **changes):
    return replace(share, approach=replace(share.approach, **changes))


def by_the_line(share, change):
    """A share whose way out has another middle line."""
    out = share.approach.out
    return approached(share, out=replace(out, line=change(out.line)))


def honest_about_length(share):
    approach = share.approach
    return approached(share, legs_m=legs_length_m(approach.out, approach.home, approach.apart_m))


def beyond(place):
    return (place[0], place[1] + 300.0)


FALSE_SHARES = {
    "off the lake": (lambda a, b: (a, replace(b, area=moved(b.area, 300.0))), "'b' leaves the free space"),
    "a stranger's": (lambda a, b: (a, replace(b, vehicle="nobody")), "those of a, nobody, not of a, b"),
    "one's twice": (lambda a, _: (a, a), "those of a, a, not of a, b"),
    "none for one": (lambda a, _: (a,), "those of a, not of a, b"),
    "one upon the other": (
        lambda a, b: (a, replace(b, area=b.area.union(a.area))),
        r"shares overlap by \d+",
    ),
    "too small": (
        lambda a, b: (
            replace(a, area=a.area.difference(a.area.representative_point().buffer(10.0, cap_style="square"))),
            b,
        ),
        r"leave 400 m2 of the free space to nobody",
    ),
    "one for another": (
        lambda a, b: (replace(a, vehicle="b"), replace(b, vehicle="a", approach=a.approach)),
        "no leg leads 'a' from its place to its share",
    ),
    "gate off the water": (
        lambda a, b: (a, approached(b, launch=beyond(b.approach.launch))),
        "'b' has a gate that is not at the share",
    ),
    "gate off the water, leg to it": (
        lambda a, b: (
            a,
            by_the_line(
                approached(b, launch=beyond(b.approach.launch)),
                lambda line: LineString([*line.coords[:-1], beyond(line.coords[-1])]),
            ),
        ),
        "'b' has a gate that is not at the share",
    ),
    "no leg to a gate": (
        lambda a, b: (a, approached(b, home=None)),
        "no leg leads 'b' from its place to its share",
    ),
    "gate in place of the start": (
        lambda a, b: (approached(a, launch=beyond(a.approach.launch)), b),
        "'a' begins 0 m from its place and ends 300 m from its gate",
    ),
    "leg from elsewhere": (
        lambda a, b: (a, by_the_line(b, lambda line: LineString([beyond(line.coords[0]), *line.coords[1:]]))),
        "begins 300 m from its place",
    ),
    "legs shorter than they are": (lambda a, b: (a, approached(b, legs_m=1.0)), r"takes 1\.0 m, but its legs"),
    "legs longer than they are": (
        lambda a, b: (a, approached(b, legs_m=1900.0)),
        r"takes 1900\.0 m, but its legs",
    ),
    "legs longer than the range": (
        lambda a, b: (
            a,
            honest_about_length(
                by_the_line(b, lambda line: LineString([line.coords[0], (20.0, 5_000.0), *line.coords[1:]]))
            ),
        ),
        r"takes \d+\.\d m, of 2000\.0 m",
    ),
}


@pytest.mark.parametrize(("change", "message"), FALSE_SHARES.values(), ids=FALSE_SHARES.keys())
def test_a_false_share_is_refused(change, message):
    with pytest.raises(Internal, match=message) as raised:
        plan_mission(pond(Vehicles=FLEET), OPTIONS, call=of_the_far_one(change))
    assert raised.value.where == "assignment"


@pytest.mark.parametrize("is_claimed", [False, True], ids=["not claimed", "claimed to be water"])
def test_no_boat_follows_a_leg_over_an_island(is_claimed):
    def change(near, far):
        changed = by_the_line(far, lambda line: LineString([line.coords[0], (200.0, 100.0), line.coords[-1]]))
        water = (shapely.box(-1e3, -1e3, 1e3, 1e3),) if is_claimed else far.approach.water
        return near, honest_about_length(approached(changed, water=water))

    lying = of_the_far_one(change)
    lying.changed[CERTIFY.stage] = praised
    with pytest.raises((Infeasible, Internal)):
        plan_mission(pond(Vehicles=FLEET), OPTIONS, call=lying)


def test_the_error_names_the_vehicle_the_place_and_the_metres():
    fault = Fault(rule=Rule.OUTSIDE, metres=3.2, place=(0.0, 0.0), track=1)
    lying = Lying(**{CERTIFY.stage: lambda _, r: replace(r, faults=(fault,))})
    with pytest.raises(
        Internal, match=r"b: path: runs 3\.20 m outside the water, at lat 46\.00\d+, long 2\.00\d+"
    ):
        plan_mission(pond(Vehicles=FLEET), OPTIONS, call=lying)


def test_the_truth_passes():
    completed = plan_mission(pond(Vehicles=FLEET), OPTIONS, call=Lying())
    assert all(len(vehicle.certificate.legs) == 2 for vehicle in completed.plan.fleet.vehicles)
