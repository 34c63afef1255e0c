"""Measurements of Oxbow: ``python -m tests.bench``."""
