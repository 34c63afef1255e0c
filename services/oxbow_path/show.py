"""What the path stage shows: transects, circuit, cuts, the path of every turn of the spacing loop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely
from shapely import LineString

from oxbow.contracts import FloatArray
from oxbow.recording import Layer, LayerKind, Show
from oxbow_path.planner import TransectPlan

__all__ = ["show_plan"]

STAGE = "path"


def show_plan(plan: TransectPlan, back: Callable[[FloatArray], FloatArray], show: Show) -> None:
    """Show a plan; `back` turns the sweep frame into the planar frame."""
    for step, trial in enumerate(plan.trials):
        show(
            Layer(
                stage=STAGE,
                name="iterations",
                step=step,
                geometries=(shapely.transform(trial.path, back),),
                labels=(f"spacing {trial.pattern.spacing_m:.1f} m, reach {trial.pattern.reach:g}",),
            )
        )
        figures = {"spacing_m": trial.pattern.spacing_m, "length_m": trial.length_m}
        show(Layer(stage=STAGE, name="loop", kind=LayerKind.SCALARS, step=step, scalars=figures))
    chosen = plan.chosen
    lines = {
        "transects": chosen.circuit.transects,
        "circuit": chosen.circuit.links,
        "cuts": chosen.walk.cuts,
        "path": (chosen.path,),
    }
    for name, geometries in lines.items():
        show(Layer(stage=STAGE, name=name, geometries=_turned(geometries, back)))


def _turned(lines: tuple[LineString, ...], back: Callable[[FloatArray], FloatArray]) -> tuple[LineString, ...]:
    return tuple(shapely.transform(np.asarray(lines, dtype=object), back)) if lines else ()
