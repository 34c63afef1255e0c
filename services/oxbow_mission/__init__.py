"""Accepts missions, keeps them, has the stages plan them, and publishes status, plans and replans."""
