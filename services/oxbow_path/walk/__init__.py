"""The walk round a tree: the construction that all methods begin with, closed, simple and inside."""
