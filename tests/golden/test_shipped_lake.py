"""A real lake that ships with the project, judged by pyproj and shapely alone: nothing of Oxbow judges itself."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely
from shapely import LineString, Point, Polygon, box

from oxbow.contracts import Method
from oxbow.mission.file import mission_json, read_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import plan_mission
from oxbow_cli.local import local_call

LAKE = Path(__file__).with_name("nipigon.json")
WGS84 = pyproj.Geod(ellps="WGS84")
NEAR_M = 0.5
"""What another projection of a lake of 130 km may differ by."""


@dataclass(frozen=True)
class Survey:
    """A lake and a path in it, in metres; `length_m` is along the ellipsoid."""

    water: Polygon
    path: LineString
    launch: Point
    recovery: Point
    safety_m: float
    length_m: float
    most_m: float

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> Survey:
        outline = _degrees(document["BoundingBox"])
        long, lat = outline.mean(axis=0)
        plane = pyproj.Proj(proj="aeqd", lon_0=long, lat_0=lat, ellps="WGS84")
        path = _degrees(document["Master_Path"])

        def flat(degrees: np.ndarray) -> np.ndarray:
            return np.column_stack(plane(*degrees.T))

        return cls(
            water=Polygon(flat(outline), [flat(_degrees(zone)) for zone in document["ForbiddenZones"]]),
            path=LineString(flat(path)),
            launch=Point(flat(_degrees([document["LaunchPoint"]]))[0]),
            recovery=Point(flat(_degrees([document["RecoveryPoint"]]))[0]),
            safety_m=document["Safety"],
            length_m=WGS84.line_length(*path.T),
            most_m=document["Master_length"],
        )

    def faults(self) -> set[str]:
        """What forbids the path; a boat may come within the safety distance on its legs from and to the shore."""
        found = set()
        if not self.path.is_simple:
            found.add("crosses itself")
        ends = shapely.points(shapely.get_coordinates(self.path)[[0, -1]])
        if (shapely.distance(ends, [self.launch, self.recovery]) > NEAR_M).any():
            found.add("ends elsewhere")
        if self.length_m > self.most_m:
            found.add("is too long")
        if not self.water.buffer(NEAR_M).covers(self.path):
            found.add("goes ashore")
        near = self.path.difference(self.water.buffer(NEAR_M - self.safety_m, quad_segs=64))
        for part in shapely.get_parts(shapely.line_merge(near)):
            if part.distance(shapely.multipoints(ends)) > NEAR_M or part.length > 2 * self.safety_m:
                found.add("comes too near the shore")
        return found

    def q(self) -> float:
        """The farthest water over half the spacing of even tracks of that length; 1 is ideal.

        Water is what a boat may enter, with a lattice of 400 m and the vertices of its shore.
        """
        free = self.water.buffer(-self.safety_m, quad_segs=64)
        x0, y0, x1, y1 = free.bounds
        x, y = (side.ravel() for side in np.meshgrid(np.arange(x0, x1, 400.0), np.arange(y0, y1, 400.0)))
        inside = shapely.contains_xy(free, x, y)
        places = np.vstack([np.column_stack([x, y])[inside], shapely.get_coordinates(free)])
        shapely.prepare(self.path)
        return float(shapely.distance(self.path, shapely.points(places)).max()) * 2 * self.path.length / free.area


def _degrees(positions: list[dict[str, float]]) -> np.ndarray:
    return np.array([(position["long"], position["lat"]) for position in positions])


SQUARE = box(0, 0, 1000, 1000)
EVEN = LineString([(0, 100), (900, 100), (900, 300), (100, 300), (100, 500), (900, 500), (900, 700), (0, 700)])
SOUND = Survey(SQUARE, EVEN, Point(0, 100), Point(0, 700), safety_m=90.0, length_m=EVEN.length, most_m=EVEN.length)


@pytest.mark.parametrize(
    ("survey", "faults"),
    [
        (SOUND, set()),
        (replace(SOUND, most_m=SOUND.length_m - 1), {"is too long"}),
        (replace(SOUND, launch=Point(1, 100)), {"ends elsewhere"}),
        (replace(SOUND, safety_m=102.0), {"comes too near the shore"}),
        (replace(SOUND, water=SQUARE.difference(box(500, 420, 510, 430))), {"comes too near the shore"}),
        (
            replace(SOUND, water=SQUARE.difference(box(500, 490, 510, 510))),
            {"goes ashore", "comes too near the shore"},
        ),
        (
            replace(SOUND, path=LineString(np.array(EVEN.coords)[[0, 1, 2, 4, 3, 5, 6, 7]])),
            {"crosses itself"},
        ),
    ],
    ids=["none", "length", "launch", "legs", "islet", "aground", "crossing"],
)
def test_the_judge_finds_each_fault(survey, faults):
    assert survey.faults() == faults


def test_the_judge_finds_water_that_is_left_out():
    assert replace(SOUND, path=LineString(EVEN.coords[:4])).q() > SOUND.q() > 1.0


@pytest.mark.parametrize(
    ("method", "worst_q"),
    [
        (Method.SPACE_FILLING_CURVE, 1.47),
        (Method.TRANSECT, 1.67),
        (Method.TOUR, 1.53),
        (Method.WATERSHED, 1.47),
    ],
)
def test_every_method_surveys_it(method, worst_q):
    """The bounds leave a tenth of what was measured."""
    planned = plan_mission(read_mission(LAKE), PlanOptions(method=method), call=local_call())
    survey = Survey.of(json.loads(mission_json(planned)))
    assert survey.faults() == set()
    assert survey.length_m >= 0.95 * survey.most_m
    assert survey.q() <= worst_q
