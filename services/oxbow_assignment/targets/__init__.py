"""Sharing targets out among vehicles: clusters, matching, order, and moves between tours."""
