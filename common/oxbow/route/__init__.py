"""Routes through the water: several methods behind one `Router`."""

from oxbow.route.access import Landing, leg_routes, way_to
from oxbow.route.danger import NO_DANGER, Danger
from oxbow.route.dynamic import DynamicRouter
from oxbow.route.field import lengths_from
from oxbow.route.gate_routes import Routes
from oxbow.route.methods import make_router
from oxbow.route.route import Route, RouteMethod, Router, RouteTable

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
