"""A client of a service that plans with trivial stages."""

from tests.support.mission_stack import bus, client, home, router

__all__ = ["bus", "client", "home", "router"]
