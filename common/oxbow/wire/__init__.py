"""Bytes on the bus: geometry, envelopes, layers, and what processes report about themselves."""
