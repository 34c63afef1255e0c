"""Coverage from the border to the core (Balampanis, Maza and Ollero 2016, section V)."""

from oxbow_path.watershed.method import plan_watershed, watershed

__all__ = ["plan_watershed", "watershed"]
