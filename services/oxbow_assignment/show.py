"""What the stage shows: the mesh and its shares, hot spots, danger zones, clusters, passes, routes and sorties."""

from __future__ import annotations

import numpy as np
from shapely import LineString

from oxbow.contracts import DangerZone, HotSpot, Share, Sortie
from oxbow.geometry.route import Route, RouteMethod, make_router
from oxbow.wire.recording import Layer, LayerKind, Show, is_watched
from oxbow_assignment.shares.partition import Partition
from oxbow_assignment.treatment.campaign import Campaign

__all__ = ["show_campaign", "show_partition", "show_shares"]

STAGE = "assignment"

MOST_LEGS = 20
"""At most this many routes are shown by every method, so that the viewer need not wait for them."""


def show_partition(partition: Partition, show: Show) -> None:
    """Show the mesh's edges, and every triangle by its depth in the wavefront of its share.

    Parameters
    ----------
    partition
        The mesh and its shares.
    show
        Takes the layers.
    """
    mesh, depth = partition.mesh, partition.depth
    corners = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = map(LineString, mesh.points[np.unique(corners, axis=0)])
    show(Layer(stage=STAGE, name="mesh", geometries=tuple(edges)))
    values = tuple((depth / max(1, int(depth.max()))).tolist())
    show(Layer(stage=STAGE, name="wavefront", geometries=tuple(mesh.polygons.tolist()), values=values))


def show_shares(shares: tuple[Share, ...], show: Show) -> None:
    """Show every master's share.

    Parameters
    ----------
    shares
        What is shown.
    show
        Takes the layer.
    """
    labels = tuple(f"{share.vehicle}: {share.area.area:.0f} m²" for share in shares)
    show(Layer(stage=STAGE, name="shares", geometries=tuple(share.area for share in shares), labels=labels))


def show_campaign(
    spots: tuple[HotSpot, ...],
    campaign: Campaign,
    sorties: tuple[Sortie, ...],
    further: tuple[Sortie, ...],
    show: Show,
) -> None:
    """Show hot spots, danger zones, passes, clusters of the first round, the routes between, and all sorties.

    Parameters
    ----------
    spots
        All hot spots, those that are not treated among them.
    campaign
        Their treatment.
    sorties, further
        The sorties of the first round, and of the rounds after it.
    show
        Takes the layers.
    """
    labels = tuple(f"{spot.name}: {spot.value:g}" for spot in spots)
    show(Layer(stage=STAGE, name="hot_spots", geometries=tuple(spot.area for spot in spots), labels=labels))
    if campaign.fleet.danger.zones:
        show(_danger_zones(campaign.fleet.danger.zones))
    passes = tuple(line for treatment in campaign.treatments for line in treatment.passes)
    show(Layer(stage=STAGE, name="passes", geometries=passes))
    show(_clusters(campaign))
    routes = tuple(
        route for journeys in campaign.schedule.rounds for journey in journeys for route in journey.routes
    )
    show(Layer(stage=STAGE, name="routes", geometries=routes))
    if is_watched(show):
        _show_routes_of_every_method(campaign, show)
    for name, group in (("sorties", sorties), ("further", further)):
        labels = tuple(f"{sortie.vehicle}: {', '.join(sortie.hot_spots)}" for sortie in group)
        show(Layer(stage=STAGE, name=name, geometries=tuple(sortie.path for sortie in group), labels=labels))
    lengths = {sortie.vehicle: sortie.length_m for sortie in sorties}
    show(Layer(stage=STAGE, name="figures", kind=LayerKind.SCALARS, scalars=lengths))


def _danger_zones(zones: tuple[DangerZone, ...]) -> Layer:
    """Every danger zone, coloured by its danger."""
    return Layer(
        stage=STAGE,
        name="danger_zones",
        geometries=tuple(zone.area for zone in zones),
        labels=tuple(f"{zone.name}: danger {zone.probability:g} per {zone.per}" for zone in zones),
        values=tuple(zone.probability for zone in zones),
    )


def _show_routes_of_every_method(campaign: Campaign, show: Show) -> None:
    """The first sorties' routes as every method finds them, side by side."""
    fleet = campaign.fleet
    journeys = campaign.schedule.rounds[0] if campaign.schedule.rounds else ()
    legs = [route for journey in journeys for route in journey.routes if route.length > 0.0][:MOST_LEGS]
    for method in RouteMethod:
        router = make_router(method, fleet.free, fleet.danger)
        routes = [router.route(leg.coords[0], leg.coords[-1]) for leg in legs]
        show(
            Layer(
                stage=STAGE,
                name=f"routes_{method}",
                geometries=tuple(route.line for route in routes),
                labels=tuple(_label(route) for route in routes),
            )
        )


def _label(route: Route) -> str:
    danger = f", danger {route.danger:.1%}" if route.danger > 0.0 else ""
    return f"{route.length_m:.0f} m, {route.clearance_m:.1f} m from the shore{danger}"


def _clusters(campaign: Campaign) -> Layer:
    """The middle of each part of the first round, labelled by its cluster."""
    first = campaign.schedule.first
    if first is None or first.clustered.clusters is None:
        return Layer(stage=STAGE, name="clusters")
    parts = [campaign.division.parts[target] for target in first.clustered.targets.tolist()]
    return Layer(
        stage=STAGE,
        name="clusters",
        geometries=tuple(part.line.interpolate(0.5, normalized=True) for part in parts),
        labels=tuple(f"cluster {label}" for label in first.clustered.clusters.labels.tolist()),
    )
