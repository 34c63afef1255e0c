"""Treating hot spots: passes, parts, sorties."""
