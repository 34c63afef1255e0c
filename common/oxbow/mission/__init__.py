"""The Mission File: its fields, and how it is read and written."""
