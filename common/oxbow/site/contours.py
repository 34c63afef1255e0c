"""Contours of a Mission File in planar metres: the polygons of its outline and of its zones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from oxbow.arrays import FloatArray, Geometries, Place
from oxbow.errors import InvalidMission
from oxbow.geometry.crossings import MOST_PAIRS, Edges, TooManyPairs, self_contact
from oxbow.geometry.frame import Frame, Position, lonlat
from oxbow.mission.file import Mission

__all__ = ["MAX_RADIUS_M", "Contour", "Zone", "danger_zones", "forbidden_zones", "require_points"]

MAX_RADIUS_M = 300_000.0
"""How far a site may reach from the mean of its contour's points, and how far a launch point may be from water."""
MOST_POINTS = 2_000_000
"""Of all contours of a mission; the largest shores of the world have a million."""
MOST_OWN_CROSSINGS = 10_000
"""Of all zones of one kind with themselves; each costs 60 us and 2 kB where zones are brought into order."""
MOST_CROSSINGS = 100_000
"""Of zones with one another and with the outline; each costs 25 us and 1.3 kB where the water is cut out."""

LEAST_WIDTH_M = 1e-3
"""Points that lie in a strip narrower than this lie on one line."""


@dataclass(frozen=True)
class Contour:
    """A contour without its repeated points; `indices` are those of its points in the Mission File."""

    name: str
    degrees: FloatArray
    indices: np.ndarray[tuple[int], np.dtype[np.intp]]

    @classmethod
    def of(cls, name: str, positions: Sequence[Position]) -> Contour:
        """The contour of a field of the Mission File.

        Parameters
        ----------
        name
            The field, for errors.
        positions
            Its points in order, closed or not; neighbours may be equal.

        Returns
        -------
        Contour
            Of three points or more; which orientation they have does not matter.

        Raises
        ------
        InvalidMission
            Fewer than three points are left without repetitions.
        """
        degrees = lonlat(positions)
        # The first point is compared with the last, too: a closed contour keeps one of the two.
        indices = np.flatnonzero((degrees != np.roll(degrees, 1, axis=0)).any(axis=1))
        if len(indices) < 3:
            raise _too_few(name, degrees)
        return cls(name, degrees[indices], indices)

    def planar(self, frame: Frame) -> Polygon:
        """The contour as a polygon that has an area; it may meet itself."""
        xy = frame.to_planar(self.degrees)
        if not np.isfinite(xy).all():
            raise InvalidMission("reaches to the other side of the Earth", where=self.name)
        # The hull and not the contour's own area: a figure of eight may have none, and encloses water all the
        # same.
        hull = shapely.convex_hull(LineString(xy))
        # Both long sides of a strip are in its hull's perimeter.
        if hull.area < LEAST_WIDTH_M * hull.length / 2:
            if len(np.unique(self.degrees, axis=0)) < 3:
                raise _too_few(self.name, self.degrees)
            raise InvalidMission(
                "has all its points on one line; expected a contour with an area", where=self.name
            )
        return Polygon(xy)

    def outline(self, frame: Frame) -> Polygon:
        """The contour as a valid polygon in normal form.

        Raises
        ------
        InvalidMission
            It reaches too far, has no area, or meets itself; the error says where.
        """
        polygon = self.planar(frame)
        radius_m = np.hypot(*shapely.get_coordinates(polygon).T)
        if radius_m.max() > MAX_RADIUS_M:
            farthest = int(np.argmax(radius_m[:-1]))  # the closing point has no index of its own
            raise InvalidMission(
                f"is {radius_m.max() / 1000:.0f} km from the mean of the points;"
                f" expected a site that reaches at most {MAX_RADIUS_M / 1000:.0f} km from there",
                where=f"{self.name}[{self.indices[farthest]}]",
            )
        with _comparable(self.name):
            contact = self_contact(polygon)
        if contact is not None:
            raise self._crossing(frame, polygon, contact)
        return shapely.normalize(polygon)

    def _crossing(self, frame: Frame, polygon: Polygon, place: Place) -> InvalidMission:
        """Where an outline meets itself, and which of its edges do."""
        xy = shapely.get_coordinates(polygon)
        distance = shapely.distance(shapely.linestrings(np.stack([xy[:-1], xy[1:]], axis=1)), Point(place))
        # The two edges nearest to the place are those that meet there.
        edges = np.sort(np.argsort(distance, kind="stable")[:2])
        # Points of the Mission File, repeated ones counted: the author looks for them there.
        following = np.roll(self.indices, -1)
        one, other = (f"the edge from point {self.indices[edge]} to {following[edge]}" for edge in edges)
        long, lat = frame.to_degrees(np.array([place]))[0]
        return InvalidMission(
            f"meets itself at lat {lat:.7f}, long {long:.7f}, where {one} meets {other};"
            " expected a contour that neither crosses nor touches itself",
            where=f"{self.name}[{self.indices[edges[0]]}]",
        )


def require_points(mission: Mission) -> None:
    """Refuse a mission whose contours have more points than can be looked at in bounded time and memory."""
    dangers = [zone.contour for zone in mission.danger_zones or ()]
    points = sum(map(len, (mission.outline, *mission.forbidden_zones, *dangers)))
    if points > MOST_POINTS:
        raise InvalidMission(
            f"has {points} points with its zones; expected at most {MOST_POINTS}", where=mission.outline_name
        )


@contextmanager
def _comparable(name: str) -> Iterator[None]:
    """Say which contours have more edges side by side than can be compared."""
    try:
        yield
    except TooManyPairs as error:
        raise InvalidMission(
            f"has so many long edges side by side that over {MOST_PAIRS} pairs of them would have to be"
            " compared; expected a contour of shorter edges or fewer points",
            where=name,
        ) from error


def _too_few(name: str, degrees: FloatArray) -> InvalidMission:
    distinct = len(np.unique(degrees, axis=0))
    return InvalidMission(f"has {distinct} distinct points; expected at least 3", where=name)


@dataclass(frozen=True)
class Zone:
    """The polygons that a zone's contour encloses, none where it lies outside the water, and warnings about it."""

    parts: tuple[Polygon, ...] = ()
    warnings: tuple[str, ...] = ()


def forbidden_zones(mission: Mission, frame: Frame, outline: Polygon) -> list[Zone]:
    """A mission's forbidden zones, one by one.

    Parameters
    ----------
    mission
        The mission.
    frame
        The site's plane.
    outline
        The site's contour in that plane, valid.

    Returns
    -------
    list of Zone
        In the order of the mission. A zone outside the water has no parts, and a warning says so.

    Raises
    ------
    InvalidMission
        A zone has no area, or zones meet themselves, one another or the outline too often.
    """
    contours = [
        Contour.of(f"ForbiddenZones[{index}]", contour) for index, contour in enumerate(mission.forbidden_zones)
    ]
    zones = _Zones("ForbiddenZones", "forbidden", contours, mission.outline_name)
    return zones.within(outline, frame)


def danger_zones(mission: Mission, frame: Frame, outline: Polygon) -> list[Zone]:
    """A mission's danger zones, one by one; see `forbidden_zones`.

    Parameters
    ----------
    mission
        The mission.
    frame
        The site's plane.
    outline
        The site's contour in that plane, valid.

    Returns
    -------
    list of Zone
        In the order of the mission, as of `forbidden_zones`.
    """
    contours = [
        Contour.of(f"DangerZones[{index}].Contour", zone.contour)
        for index, zone in enumerate(mission.danger_zones or ())
    ]
    zones = _Zones("DangerZones", "dangerous", contours, mission.outline_name)
    return zones.within(outline, frame)


@dataclass(frozen=True)
class _Zones:
    """The contours of zones that are all `what`: the field that has them, and the one that has the outline."""

    field: str
    what: str
    contours: Sequence[Contour]
    outline_name: str

    def within(self, outline: Polygon, frame: Frame) -> list[Zone]:
        """The zone that each contour makes on the water of an outline.

        Raises
        ------
        InvalidMission
            A zone has no area, or they meet themselves, one another or the outline too often.
        """
        if not self.contours:
            return []
        polygons = np.array([contour.planar(frame) for contour in self.contours])
        with _comparable(self.field):
            self._require_few_crossings(polygons, outline)
        valid = shapely.is_valid(polygons)
        return [
            self._zone(index, *found, outline) for index, found in enumerate(zip(polygons, valid, strict=True))
        ]

    def _zone(self, index: int, polygon: Polygon, is_valid: bool, outline: Polygon) -> Zone:
        name = f"{self.field}[{index}]"
        parts = (polygon,) if is_valid else _enclosed(polygon)
        warnings = () if is_valid else (f"{name} meets itself: all that it encloses is {self.what}",)
        if not shapely.intersects(outline, parts).any():
            return Zone(warnings=(*warnings, f"{name} lies outside {self.outline_name}: it has no effect"))
        return Zone(parts, warnings)

    def _require_few_crossings(self, polygons: Geometries, outline: Polygon) -> None:
        """Refuse zones of which there would be more pieces than memory."""
        edges = Edges.of(np.array([*polygons, outline]))
        # An outline may have a million edges: only those near a zone can meet one.
        edges = edges.where(edges.within(shapely.total_bounds(polygons)))
        of_zones = edges.ring < len(polygons)
        own, crossings = np.zeros(len(polygons), dtype=int), 0
        for pairs in edges.meetings(of=of_zones):
            one, other = edges.ring[pairs].T
            # Block by block, so that the refusal comes before the pairs take all memory.
            own += np.bincount(one[one == other], minlength=len(polygons))
            crossings += int((one != other).sum())
            if own.sum() > MOST_OWN_CROSSINGS:
                raise InvalidMission(
                    f"meets itself, with the other zones, more than {MOST_OWN_CROSSINGS} times; expected a"
                    " contour that goes round once",
                    where=self.contours[int(np.argmax(own))].name,
                )
            if crossings > MOST_CROSSINGS:
                raise InvalidMission(
                    f"cross one another and {self.outline_name} more than {MOST_CROSSINGS} times; expected"
                    " zones that overlap less",
                    where=self.field,
                )


def _enclosed(zone: Polygon) -> tuple[Polygon, ...]:
    """All that a contour which meets itself encloses, whichever way it was meant."""
    # Not `make_valid`, which would leave out what an even number of rounds encloses.
    faces = shapely.polygonize([shapely.node(zone.exterior)])
    whole = shapely.union_all(shapely.get_parts(faces))
    return tuple(Polygon(part.exterior) for part in shapely.get_parts(whole))
