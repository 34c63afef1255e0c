"""The stage `certificate`: judges paths and shows where they leave gaps."""

from __future__ import annotations

from shapely import Point

from oxbow.contracts import Certificate, CertifyRequest
from oxbow.wire.recording import Layer, LayerKind, Show
from oxbow_certificate.certify import Judgement, judge

__all__ = ["handle"]

STAGE = "certificate"
RED = (214, 47, 39)

GAP_RATIO = 1.1
"""Places farther from the path than this many least radii are shown as gaps; ideal transects have none above 1."""

RULES = ("length_m", "outside_m", "unsafe_m", "judged_area", "crossings", "turns")
COVERAGE = ("q", "mean_ratio", "p95_ratio", "p99_ratio")
EVENNESS = ("least_leg_distance_m", "discrepancy_ratio", "directional_evenness")


def handle(request: CertifyRequest, show: Show) -> Certificate:
    """Certify a request's paths, and show them, their gaps, the worst gap and the figures.

    Parameters
    ----------
    request
        The paths, and the mission that they are judged by.
    show
        Takes the layers of the recording.

    Returns
    -------
    Certificate
        That of all paths together.

    Raises
    ------
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    judgement = judge(request)
    show(Layer(stage=STAGE, name="path", geometries=tuple(track.path for track in request.tracks)))
    show(_gaps(judgement))
    show(_worst_gap(judgement))
    figures = {name: getattr(judgement.certificate, name) for name in RULES + COVERAGE + EVENNESS}
    # A layer's figures are numbers: what cannot be computed for this path is left out.
    known = {name: float(figure) for name, figure in figures.items() if figure is not None}
    show(Layer(stage=STAGE, name="figures", kind=LayerKind.SCALARS, scalars=known))
    return judgement.certificate


def _gaps(judgement: Judgement) -> Layer:
    """Sampled places far from every path, coloured by distance from the threshold (0) to the largest (1)."""
    spread = judgement.spread
    far_m = GAP_RATIO * judgement.certificate.least_radius_m
    far = spread.distance_m > far_m
    return Layer(
        stage=STAGE,
        name="gaps",
        geometries=tuple(Point(place) for place in spread.places[far]),
        values=tuple(((spread.distance_m[far] - far_m) / (judgement.cover.high_m - far_m)).tolist()),
    )


def _worst_gap(judgement: Judgement) -> Layer:
    cover, q = judgement.cover, judgement.certificate.q
    label = f"{cover.low_m:.0f} m from the path, {q:.2f} times the least possible"
    return Layer(stage=STAGE, name="worst_gap", geometries=(Point(cover.place),), labels=(label,), colour=RED)
