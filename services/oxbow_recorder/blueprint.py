"""What an engineer sees first: a tab a stage, the map, and the log with the timings."""

from __future__ import annotations

import rerun.blueprint as rrb

__all__ = ["blueprint"]


def blueprint() -> rrb.Blueprint:
    """The arrangement that every recording carries."""
    return rrb.Blueprint(
        rrb.Tabs(
            _path(),
            rrb.Spatial2DView(origin="contour", name="Contour"),
            _assignment(),
            _decomposition(),
            _certificate(),
            rrb.MapView(origin="map", name="Map"),
            _log(),
            active_tab=0,
        ),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed"),
    )


def _path() -> rrb.Horizontal:
    return rrb.Horizontal(
        rrb.Spatial2DView(
            origin="/",
            name="Path, and the tree that it began with",
            contents=[
                "contour/eroded/**",
                "path/transects/**",
                "path/circuit/**",
                "path/cuts/**",
                "path/contours/**",
                "path/links/**",
                "path/sites/**",
                "path/path/**",
            ],
        ),
        rrb.Vertical(
            rrb.Spatial2DView(
                origin="/",
                name="Step by step: spacing loop or ring, then the refinement",
                contents=["contour/eroded/**", "path/iterations/**", "path/ring/**", "path/refined/**"],
            ),
            rrb.TimeSeriesView(
                origin="path",
                name="Length, spacing, distances per step",
                contents=["$origin/loop/**", "$origin/epochs/**", "$origin/refinement/**"],
            ),
            row_shares=[3, 1],
        ),
        column_shares=[3, 2],
        name="Path",
    )


def _decomposition() -> rrb.Horizontal:
    return rrb.Horizontal(
        rrb.Spatial2DView(
            origin="decomposition",
            name="Cells and critical points",
            contents=["$origin/cells/**", "$origin/critical_points/**"],
        ),
        rrb.Vertical(
            rrb.GraphView(origin="decomposition/reeb", name="Reeb graph"),
            rrb.TimeSeriesView(origin="decomposition/scores", name="Predicted cost of each heading"),
            row_shares=[3, 1],
        ),
        column_shares=[3, 2],
        name="Decomposition",
    )


def _assignment() -> rrb.Horizontal:
    return rrb.Horizontal(
        rrb.Spatial2DView(
            origin="/",
            name="Shares, and the mesh that they are made of",
            contents=[
                "contour/eroded/**",
                "assignment/mesh/**",
                "assignment/wavefront/**",
                "assignment/shares/**",
            ],
        ),
        rrb.Spatial2DView(
            origin="/",
            name="Hot spots, passes and sorties",
            contents=[
                "contour/eroded/**",
                "assignment/hot_spots/**",
                "assignment/passes/**",
                "assignment/clusters/**",
                "assignment/routes/**",
                "assignment/sorties/**",
                "assignment/further/**",
            ],
        ),
        name="Assignment",
    )


def _certificate() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin="/", name="Certificate", contents=["contour/raw/**", "certificate/**"])


def _log() -> rrb.Vertical:
    return rrb.Vertical(
        rrb.TextLogView(origin="log", name="Log"),
        rrb.DataframeView(
            origin="/", name="Timings and figures", contents=["mission/**", "certificate/figures/**"]
        ),
        name="Log and timings",
    )
