"""The decomposition stage: from free space to cells and their Reeb graph."""

from __future__ import annotations

import shapely
from shapely import Point

from oxbow.contracts import DecomposeRequest, Decomposition, HeadingScore
from oxbow.geometry.reeb import cell_polygon
from oxbow.geometry.sweep import from_sweep
from oxbow.wire.recording import Layer, LayerKind, Show
from oxbow_decomposition.cells import decompose
from oxbow_decomposition.headings import scored_headings

__all__ = ["handle"]

STAGE = "decomposition"


def handle(request: DecomposeRequest, show: Show) -> Decomposition:
    """Cut the free space along the given heading, or the one of least predicted cost.

    Parameters
    ----------
    request
        The free space, the spacing that the plan will have, and a heading if it is to be that one.
    show
        Receives the layers `scores`, `cells`, `critical_points` and `reeb`.

    Returns
    -------
    Decomposition
        The cells, with the scores of all headings where one was chosen.
    """
    scores: tuple[HeadingScore, ...] = ()
    heading_rad = request.heading_rad
    if heading_rad is None:
        scores = scored_headings(request.free, request.spacing_m)
        _show_scores(scores, show)
        heading_rad = min(scores, key=lambda score: score.predicted_cost).heading_rad
    decomposition = decompose(request.free, heading_rad, scores)
    _show_cells(decomposition, show)
    return decomposition


def _show_scores(scores: tuple[HeadingScore, ...], show: Show) -> None:
    for step, score in enumerate(scores):
        figures = {"heading_rad": score.heading_rad, "predicted_cost": score.predicted_cost}
        show(Layer(stage=STAGE, name="scores", kind=LayerKind.SCALARS, step=step, scalars=figures))


def _show_cells(decomposition: Decomposition, show: Show) -> None:
    outlines = tuple(
        shapely.transform(cell_polygon(cell), lambda uv: from_sweep(uv, decomposition.heading_rad))
        for cell in decomposition.cells
    )
    numbers = tuple(str(number) for number in range(len(outlines)))
    show(Layer(stage=STAGE, name="cells", geometries=outlines, labels=numbers))
    places = tuple(Point(point.place) for point in decomposition.critical_points)
    kinds = tuple(point.kind.value for point in decomposition.critical_points)
    show(Layer(stage=STAGE, name="critical_points", geometries=places, labels=kinds))
    edges = tuple((cell.start, cell.end) for cell in decomposition.cells)
    show(Layer(stage=STAGE, name="reeb", kind=LayerKind.GRAPH, geometries=places, nodes=kinds, edges=edges))
