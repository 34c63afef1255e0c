"""Tests of Oxbow: they mirror the packages that they test."""
