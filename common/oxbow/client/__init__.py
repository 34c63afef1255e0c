"""What a decision-support system or a vehicle's guidance talks to Oxbow with."""

from oxbow.client.client import Client, Options
from oxbow.client.updates import PlanUpdate, PlanUpdates

__all__ = ["Client", "Options", "PlanUpdate", "PlanUpdates"]
