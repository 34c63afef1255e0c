"""The space-filling curve: a Kohonen ring that starts from the walk over the cells."""

from oxbow_path.space_filling_curve.method import space_filling_curve

__all__ = ["space_filling_curve"]
