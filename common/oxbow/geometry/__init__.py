"""Planar geometry: areas, triangles, sweeps, routes, and what a path may not do. It knows no Mission File."""
