"""What an engineer sees first: a tab per stage, the map, and the log with the timings."""

from __future__ import annotations

import rerun.blueprint as rrb

__all__ = ["blueprint"]


def blueprint() -> rrb.Blueprint:
    """The arrangement that every recording carries; it opens on the finished plan."""
    return rrb.Blueprint(
        rrb.Tabs(
            _path(),
            rrb.Spatial2DView(origin="contour", name="Contour"),
            _assignment(),
            _decomposition(),
            _plane("Certificate", "contour/raw", "certificate"),
            rrb.MapView(origin="map", name="Map"),
            _log(),
            active_tab=0,
        ),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="time", play_state="following"),
    )


def _path() -> rrb.Horizontal:
    return _beside(
        "Path",
        _plane(
            "Paths, and the trees that they began with",
            "contour/eroded",
            "assignment/shares",
            "assignment/hot_spots",
            "path/transects",
            "path/circuit",
            "path/cuts",
            "path/contours",
            "path/links",
            "path/sites",
            "path/path",
            "certificate/path",
        ),
        _plane(
            "Step by step: spacing loop or ring, then the refinement",
            "contour/eroded",
            "path/iterations",
            "path/ring",
            "path/refined",
        ),
        _plot("Length, m", "path/loop/length_m", "path/epochs/length_m", "path/refinement/length_m"),
        _plot(
            "Spacing and distances to the path, m",
            "path/loop/spacing_m",
            "path/refinement/largest_distance_m",
            "path/refinement/p95_distance_m",
        ),
    )


def _assignment() -> rrb.Horizontal:
    return rrb.Horizontal(
        _plane(
            "Shares, and the mesh that they are made of",
            "contour/eroded",
            "assignment/mesh",
            "assignment/wavefront",
            "assignment/shares",
        ),
        _plane(
            "Hot spots, passes and sorties",
            "contour/eroded",
            "assignment/hot_spots",
            "assignment/danger_zones",
            "assignment/passes",
            "assignment/clusters",
            "assignment/routes",
            "assignment/sorties",
            "assignment/further",
        ),
        _plane(
            "The sorties' routes by every method, and danger zones",
            "contour/eroded",
            "assignment/danger_zones",
            "assignment/routes_visibility",
            "assignment/routes_tessellation",
            "assignment/routes_funnel",
            "assignment/routes_incenters",
        ),
        name="Assignment",
    )


def _decomposition() -> rrb.Horizontal:
    return _beside(
        "Decomposition",
        _plane("Cells and critical points", "decomposition/cells", "decomposition/critical_points"),
        rrb.GraphView(origin="decomposition/reeb", name="Reeb graph"),
        _plot("Predicted cost of each heading", "decomposition/scores/predicted_cost"),
    )


def _log() -> rrb.Vertical:
    return rrb.Vertical(
        rrb.TextLogView(origin="log", name="Log"),
        rrb.DataframeView(
            origin="/", name="Timings and figures", contents=["mission/**", "certificate/figures/**"]
        ),
        name="Log and timings",
    )


def _plane(name: str, *entities: str) -> rrb.Spatial2DView:
    """Layers of several stages in one plane."""
    return rrb.Spatial2DView(origin="/", name=name, contents=[f"{entity}/**" for entity in entities])


def _plot(name: str, *figures: str) -> rrb.TimeSeriesView:
    """Figures of one unit, step by step."""
    return rrb.TimeSeriesView(origin="/", name=name, contents=[f"{figure}/**" for figure in figures])


def _beside(name: str, main: rrb.View, second: rrb.View, *small: rrb.View) -> rrb.Horizontal:
    """A tab: one large view, and beside it a second one above small ones."""
    column = rrb.Vertical(second, *small, row_shares=[3, *(1 for _ in small)])
    return rrb.Horizontal(main, column, column_shares=[3, 2], name=name)
