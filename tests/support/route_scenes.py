"""Waters with obstacles, and places in them."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon, box

from oxbow.arrays import FloatArray
from oxbow.geometry.route import NO_DANGER, Danger, RouteMethod, Router, make_router
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.network import NetworkRouter
from oxbow.geometry.route.tessellation import Tessellation

__all__ = ["obstacle", "places_in", "scene", "scene_router"]

COARSE_M = 5.0
"""Side of a lattice in a scene: a third of what is usual by default, and a ninth of its places."""


def obstacle(rng: np.random.Generator, centre: FloatArray, radius_m: float) -> Polygon:
    """A polygon that is star-shaped about its centre."""
    angle = np.linspace(0, 2 * np.pi, rng.integers(3, 9), endpoint=False) + rng.uniform(0, 0.6)
    radius = radius_m * rng.uniform(0.4, 1.0, len(angle))
    return Polygon(centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


def scene(seed: int, obstacles: int = 6) -> Polygon:
    """A square of 100 m with obstacles, which may overlap one another and the border."""
    rng = np.random.default_rng(seed)
    land = shapely.union_all([obstacle(rng, rng.uniform(0, 100, 2), 18.0) for _ in range(obstacles)])
    largest: Polygon = max(shapely.get_parts(box(0, 0, 100, 100).difference(land)), key=shapely.area)
    return largest


def places_in(water: Polygon, count: int, seed: int) -> FloatArray:
    """Places spread over the water's triangles, so that slivers and arms have some too."""
    rng = np.random.default_rng(seed)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(water))
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    weights = rng.dirichlet(np.ones(3), count)
    return np.einsum("nk,nkj->nj", weights, corners[rng.integers(len(corners), size=count)])


def scene_router(method: RouteMethod, water: Polygon, danger: Danger = NO_DANGER) -> Router:
    """The router of a method, that of the tessellation over a coarse lattice."""
    if method is not RouteMethod.TESSELLATION:
        return make_router(method, water, danger)
    coarse = Tessellation(WaterMesh.of(water, danger.outlines), danger, side_m=COARSE_M)
    return NetworkRouter(coarse, method, coarse.reduced)
