"""The bus between Oxbow's processes, and the only code that knows Zenoh.

Callers use `oxbow.bus.client.Bus`; services forward bytes with `Session`, and `oxbow.stage` serves a stage. See
`docs/bus.md` for the keys. Calls need the contracts, which bring numpy and shapely: so `Bus` has a module of its
own, and a process that only forwards bytes goes without.
"""

from oxbow.bus.config import DEFAULT_ENDPOINT
from oxbow.bus.session import Session
from oxbow.bus.subscription import Subscription
from oxbow.wire.envelope import Envelope

__all__ = ["DEFAULT_ENDPOINT", "Envelope", "Session", "Subscription"]
