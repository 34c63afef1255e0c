"""Mission services that plan with trivial stages."""

from tests.support.mission_stack import bus, client, home, router, start_service, start_stages

__all__ = ["bus", "client", "home", "router", "start_service", "start_stages"]
