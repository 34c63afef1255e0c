"""What the Transect method shows: transects, circuit, cuts, the path of every turn of the spacing loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from oxbow_path.task import Display

if TYPE_CHECKING:
    from oxbow_path.transect.planner import TransectPlan

__all__ = ["show_transects"]


def show_transects(plan: TransectPlan, display: Display) -> None:
    """Show every trial in the order of trying, and what the chosen one is made of."""
    for step, trial in enumerate(plan.trials):
        label = f"spacing {trial.pattern.spacing_m:.1f} m, reach {trial.pattern.reach:g}"
        display.lines("iterations", [trial.path], step=step, labels=(label,))
        figures = {"spacing_m": trial.pattern.spacing_m, "length_m": trial.length_m}
        display.figures("loop", figures, step=step)
    display.lines("transects", plan.chosen.circuit.transects)
    display.lines("circuit", plan.chosen.circuit.links)
    display.lines("cuts", plan.chosen.walk.cuts)
