"""What the Transect method shows: transects, circuit, cuts, the path of every turn of the spacing loop."""

from __future__ import annotations

from oxbow_path.task import Display
from oxbow_path.walk.spacing import Fit

__all__ = ["show_transects"]


def show_transects(fit: Fit, display: Display) -> None:
    """Show every trial in the order of trying, and what the chosen one is made of.

    Parameters
    ----------
    fit
        The chosen trial, and all trials.
    display
        Receives the layers `iterations`, `loop`, `transects`, `circuit` and `cuts`.
    """
    for step, trial in enumerate(fit.trials):
        label = f"spacing {trial.pattern.spacing_m:.1f} m"
        display.lines("iterations", [trial.path], step=step, labels=(label,))
        figures = {"spacing_m": trial.pattern.spacing_m, "length_m": trial.length_m}
        display.figures("loop", figures, step=step)
    display.lines("transects", fit.chosen.circuit.transects)
    display.lines("circuit", fit.chosen.circuit.links)
    display.lines("cuts", fit.chosen.walk.cuts)
