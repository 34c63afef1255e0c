"""Routes through the water: several methods behind one `Router`."""

from oxbow.geometry.route.access import Landing, leg_routes, way_to
from oxbow.geometry.route.danger import NO_DANGER, Danger
from oxbow.geometry.route.dynamic import DynamicRouter
from oxbow.geometry.route.field import lengths_from
from oxbow.geometry.route.gate_routes import Routes
from oxbow.geometry.route.methods import make_router
from oxbow.geometry.route.route import Route, RouteMethod, Router, RouteTable

__all__ = [
    "NO_DANGER",
    "Danger",
    "DynamicRouter",
    "Landing",
    "Route",
    "RouteMethod",
    "RouteTable",
    "Router",
    "Routes",
    "leg_routes",
    "lengths_from",
    "make_router",
    "way_to",
]
