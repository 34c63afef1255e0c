"""Routes among obstacles that appear, move and disappear.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.4.1, step b: at every time step the triangulation changes
where obstacles moved, and nowhere else (`oxbow.geometry.route.retriangulation`). No mission uses this
yet: it is for replans on the way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from oxbow.arrays import FloatArray, Geometries, Mask
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.route.danger import NO_DANGER, Danger
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.methods import router_on
from oxbow.geometry.route.retriangulation import GRID_M, retriangulated
from oxbow.geometry.route.route import Route, RouteMethod, Router, RouteTable
from oxbow.tolerances import ROUNDING_M

__all__ = ["DynamicRouter"]


class DynamicRouter:
    """A router whose obstacles change.

    Vertices lie on a grid of about 1 micrometre. Obstacles may overlap each other and the shore.

    Parameters
    ----------
    water
        Where routes may run without obstacles, in planar metres.
    danger
        Zones that may be travelled at a risk. Their outlines are not among the sides of the triangulation: a
        channel is chosen by the danger between the middles of sides.
    method
        How routes are found.

    Raises
    ------
    InvalidRequest
        The water is empty or not a valid polygon.
    """

    def __init__(
        self,
        water: Polygon | MultiPolygon,
        danger: Danger = NO_DANGER,
        *,
        method: RouteMethod = RouteMethod.INCENTERS,
    ) -> None:
        # On the grid from the start: parts that are cut out and put back have to fit exactly.
        self._open_water = WaterMesh.of(shapely.set_precision(water, GRID_M))
        self._danger = danger
        self._method = method
        self._obstacles: dict[str, Polygon] = {}
        self.mesh = self._open_water

    @property
    def obstacles(self) -> Mapping[str, Polygon]:
        """The present obstacles, by name."""
        return MappingProxyType(self._obstacles)

    def put(self, name: str, area: Polygon) -> None:
        """Add an obstacle, or move the one of that name.

        Parameters
        ----------
        name
            The name to move or remove the obstacle by.
        area
            What the obstacle covers, in planar metres; it may reach beyond the water.

        Raises
        ------
        InvalidRequest
            The area is empty or not a valid polygon; names the obstacle.
        Infeasible
            It would cover all the water that is left; the obstacles stay as they are.
        """
        if area.is_empty or not shapely.is_valid(area):
            raise InvalidRequest("is empty or not a valid polygon", where=name)
        self._change(name, shapely.set_precision(area, GRID_M))

    def remove(self, name: str) -> None:
        """Take an obstacle away.

        Raises
        ------
        InvalidRequest
            There is no obstacle of that name.
        """
        if name not in self._obstacles:
            known = ", ".join(sorted(self._obstacles)) or "none, for there is no obstacle"
            raise InvalidRequest(f"is not an obstacle; expected one of: {known}", where=name)
        self._change(name, Polygon())

    def route(self, start: npt.ArrayLike, goal: npt.ArrayLike) -> Route:
        """The route among the present obstacles; see `Router.route`.

        Parameters
        ----------
        start, goal : array_like, shape (2,)
            (x, y) in metres.

        Returns
        -------
        Route
            It was right when it was found: obstacles that change later do not change it.
        """
        return self._router.route(start, goal)

    def table(self, points: npt.ArrayLike) -> RouteTable:
        """The routes among the present obstacles; see `Router.table`."""
        return self._router.table(points)

    def distances(self, points: npt.ArrayLike) -> FloatArray:
        """Costs of routes among the present obstacles; see `Router.distances`."""
        return self._router.distances(points)

    @cached_property
    def _router(self) -> Router:
        return router_on(self.mesh, self._method, self._danger)

    def _change(self, name: str, area: Polygon) -> None:
        """Replace the area that one obstacle covers; an empty area removes it."""
        obstacles = {other: polygon for other, polygon in self._obstacles.items() if other != name}
        # Where the obstacle was, and where it will be: the water changes in both.
        changed = shapely.union(self._obstacles.get(name, Polygon()), area, grid_size=GRID_M)
        if not area.is_empty:
            obstacles[name] = area
        mesh = retriangulated(self.mesh, changed, _ObstructedWater(self._open_water, tuple(obstacles.values())))
        if not len(mesh.triangles):
            raise Infeasible("covers all the water that is left", where=name)
        # Only now, so that a refusal leaves everything as it was. The router belongs to the mesh before.
        self._obstacles = obstacles
        self.mesh = mesh
        self.__dict__.pop("_router", None)


@dataclass(frozen=True)
class _ObstructedWater:
    """Open water with obstacles in it."""

    open_water: WaterMesh
    obstacles: tuple[Polygon, ...]

    def shores_near(self, areas: Geometries) -> Geometries:
        """The open water's shore and the obstacles' outlines within rounding of areas."""
        near = STRtree(areas).query(
            np.array(self.obstacles, dtype=object), predicate="dwithin", distance=ROUNDING_M
        )[0]
        outlines = [self.obstacles[number].boundary for number in np.unique(near)]
        return np.concatenate([self.open_water.shores_near(areas), outlines])

    def is_water(self, places: FloatArray) -> Mask:
        """Whether places, shape (n, 2), are in the open water and in no obstacle."""
        wet = np.zeros(len(places), dtype=np.bool_)
        wet[self.open_water.holding(places).place] = True
        for obstacle in self.obstacles:
            wet &= ~shapely.intersects_xy(obstacle, places)
        return wet
