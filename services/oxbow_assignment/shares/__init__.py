"""Sharing the water among those who survey."""
