"""The mission in metres: its water, its weights, its fleet."""
