"""Treatment of hot spots: passes, parts, sorties."""
