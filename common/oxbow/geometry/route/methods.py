"""The router of each method."""

from __future__ import annotations

from shapely import MultiPolygon, Polygon

from oxbow.geometry.route.channel import Gates
from oxbow.geometry.route.danger import NO_DANGER, Danger
from oxbow.geometry.route.funnel import funnel_line
from oxbow.geometry.route.incenters import incenter_line
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.network import NetworkRouter
from oxbow.geometry.route.route import RouteMethod, Router
from oxbow.geometry.route.tessellation import Tessellation
from oxbow.geometry.route.visibility import VisibilityGraph

__all__ = ["make_router", "router_on"]


def make_router(method: RouteMethod, water: Polygon | MultiPolygon, danger: Danger = NO_DANGER) -> Router:
    """The router of one method.

    Parameters
    ----------
    method
        How routes are found.
    water
        Where they may run, in planar metres; holes are islands. Parts of it may lie apart.
    danger
        Zones that may be travelled at a risk, and how much they count for one vehicle.

    Returns
    -------
    Router
        Ready to be asked: the water is triangulated, and the zones' outlines are among its sides.

    Raises
    ------
    InvalidRequest
        The water is empty or not a valid polygon.
    """
    return router_on(WaterMesh.of(water, danger.outlines), method, danger)


def router_on(mesh: WaterMesh, method: RouteMethod, danger: Danger) -> Router:
    """The router of one method on triangulated water.

    Parameters
    ----------
    mesh
        The water. For exact costs, the outlines of danger zones are among its sides.
    method
        How routes are found.
    danger
        Zones that may be travelled at a risk, and how much they count for one vehicle.

    Returns
    -------
    Router
        On that mesh, which is not copied.
    """
    match method:
        case RouteMethod.VISIBILITY:
            return NetworkRouter(VisibilityGraph(mesh, danger), method)
        case RouteMethod.TESSELLATION:
            tessellation = Tessellation(mesh, danger)
            return NetworkRouter(tessellation, method, tessellation.reduced)
        case RouteMethod.FUNNEL | RouteMethod.INCENTERS:
            gates = Gates(mesh, danger)
            line = funnel_line if method is RouteMethod.FUNNEL else incenter_line
            return NetworkRouter(gates, method, lambda way: line(gates.channel(way)))
