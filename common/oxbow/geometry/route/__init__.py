"""Routes through the water: several methods behind one `Router`.

Around an island, between two places to its west and east:

>>> from shapely import box
>>> from oxbow.geometry.route import RouteMethod, make_router
>>> water = box(0, 0, 100, 80) - box(40, 20, 60, 70)
>>> router = make_router(RouteMethod.VISIBILITY, water)
>>> route = router.route((10, 40), (90, 40))
>>> route.polyline.tolist()
[[10.0, 40.0], [40.0, 20.0], [60.0, 20.0], [90.0, 40.0]]
>>> f"{route.length_m:.1f} m, {route.clearance_m:.1f} m from the shore"
'92.1 m, 0.0 m from the shore'

Of all methods, this one finds the shortest routes, which touch the shore; others keep clear of it:

>>> clear = make_router(RouteMethod.INCENTERS, water).route((10, 40), (90, 40))
>>> clear.length_m > route.length_m, clear.clearance_m > 0.0
(True, True)
"""

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
