"""What the stage shows: the mesh and its shares, hot spots, clusters, passes and sorties."""

from __future__ import annotations

import numpy as np
from shapely import LineString

from oxbow.contracts import HotSpot, Share, Sortie
from oxbow.recording import Layer, LayerKind, Show
from oxbow_assignment.campaign import Campaign
from oxbow_assignment.partition import Partition

__all__ = ["show_campaign", "show_partition", "show_shares"]

STAGE = "assignment"


def show_partition(partition: Partition, show: Show) -> None:
    """The mesh's edges, and every triangle by its depth in the wavefront of its share."""
    mesh, depth = partition.mesh, partition.depth
    corners = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = map(LineString, mesh.points[np.unique(corners, axis=0)])
    show(Layer(stage=STAGE, name="mesh", geometries=tuple(edges)))
    values = tuple((depth / max(1, int(depth.max()))).tolist())
    show(Layer(stage=STAGE, name="wavefront", geometries=tuple(mesh.polygons.tolist()), values=values))


def show_shares(shares: tuple[Share, ...], show: Show) -> None:
    """Every master's share."""
    labels = tuple(f"{share.vehicle}: {share.area.area:.0f} m²" for share in shares)
    show(Layer(stage=STAGE, name="shares", geometries=tuple(share.area for share in shares), labels=labels))


def show_campaign(
    spots: tuple[HotSpot, ...],
    campaign: Campaign,
    sorties: tuple[Sortie, ...],
    further: tuple[Sortie, ...],
    show: Show,
) -> None:
    """Hot spots, their passes, the clusters of the first round, the routes between, and all sorties."""
    labels = tuple(f"{spot.name}: {spot.value:g}" for spot in spots)
    show(Layer(stage=STAGE, name="hot_spots", geometries=tuple(spot.area for spot in spots), labels=labels))
    passes = tuple(line for treatment in campaign.treatments for line in treatment.passes)
    show(Layer(stage=STAGE, name="passes", geometries=passes))
    show(_clusters(campaign))
    routes = tuple(
        route for journeys in campaign.schedule.rounds for journey in journeys for route in journey.routes
    )
    show(Layer(stage=STAGE, name="routes", geometries=routes))
    for name, group in (("sorties", sorties), ("further", further)):
        labels = tuple(f"{sortie.vehicle}: {', '.join(sortie.hot_spots)}" for sortie in group)
        show(Layer(stage=STAGE, name=name, geometries=tuple(sortie.path for sortie in group), labels=labels))
    lengths = {sortie.vehicle: sortie.length_m for sortie in sorties}
    show(Layer(stage=STAGE, name="figures", kind=LayerKind.SCALARS, scalars=lengths))


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
