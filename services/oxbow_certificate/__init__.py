"""Judges a path against its mission: conformance, coverage with certified bounds, and what was possible."""
