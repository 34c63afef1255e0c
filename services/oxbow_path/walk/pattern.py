"""The walk round transects at one spacing (Rendas and Li 2016, section 1.2.1.1)."""

from __future__ import annotations

from oxbow_path.walk.circuit import plan_circuit
from oxbow_path.walk.transects import place_transects
from oxbow_path.walk.trial import Pattern, Trial, Waters, walk_round_tree

__all__ = ["try_transects"]

LEAST_TRANSECT = 2.0
"""In spacings. Where the water is narrower, out and back along its middle is shorter than transects across."""


def try_transects(waters: Waters, pattern: Pattern) -> Trial:
    """Build the path for one pattern.

    The tree is made of transects two spacings apart, so that the legs on their two sides stand one spacing apart.

    Parameters
    ----------
    waters
        The water, its cells, and how launch and recovery points are reached.
    pattern
        The spacing, and the phase of the transects.

    Returns
    -------
    Trial
        Longer than the budget, perhaps: that is for the caller to judge.
    """
    transects = place_transects(
        waters.cells,
        2 * pattern.spacing_m,
        phase=pattern.phase,
        min_length_m=LEAST_TRANSECT * pattern.spacing_m,
    )
    circuit = plan_circuit(
        waters.cells,
        transects,
        trim_m=pattern.trim_m,
        inset_m=pattern.half_width_m + pattern.trim_m,
    )
    return walk_round_tree(waters, pattern, circuit)
