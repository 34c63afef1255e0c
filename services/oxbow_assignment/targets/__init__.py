"""Assigning targets to vehicles: clusters, matching, order, and moves between tours."""
