"""Every message between Oxbow's processes, and the endpoints that exchange them.

All geometry is planar, in metres, in the mission's local frame (`oxbow.frame`): x east, y north.
A message that exists is valid: `__post_init__` enforces its invariants on both sides of the bus.
Each stage has a module here. Key expressions stand in `keys` and nowhere else.
"""

from oxbow.contracts.assignment import Assignment, AssignRequest, HotSpot, LeftSpot, Role, Share, Sortie, Vehicle
from oxbow.contracts.certificate import (
    Certificate,
    CertifyRequest,
    Conformance,
    Measures,
    Track,
    Variogram,
    VariogramModel,
)
from oxbow.contracts.contour import ContourRequest, DroppedPart, FreeSpace
from oxbow.contracts.danger import DANGER_DETOUR_M, DangerZone, Per
from oxbow.contracts.decomposition import (
    Cell,
    CriticalKind,
    CriticalPoint,
    DecomposeRequest,
    Decomposition,
    HeadingScore,
)
from oxbow.contracts.keys import (
    ANY,
    ANY_LAYER,
    ANY_LIVE,
    INTROSPECTION,
    PLAN_KEY,
    PREFIX,
    MissionKey,
    any_introspection_key,
    any_layer_key,
    checked_id,
    introspection_key,
    layer_key,
    live_key,
    live_service,
    mission_key,
)
from oxbow.contracts.message import FloatArray, Message, Place, require_area, require_finite
from oxbow.contracts.missions import DEFAULT_DEADLINE_S, MOST_DEADLINE_S, MissionState, MissionStatus
from oxbow.contracts.path import Draw, Method, PathPlan, PathRequest, SpacingStep, WeightedArea
from oxbow.contracts.stages import ASSIGN, CERTIFY, CONTOUR, DECOMPOSE, MAX_REQUEST_BYTES, PATH, STAGES, Endpoint

__all__ = [
    "ANY",
    "ANY_LAYER",
    "ANY_LIVE",
    "ASSIGN",
    "CERTIFY",
    "CONTOUR",
    "DANGER_DETOUR_M",
    "DECOMPOSE",
    "DEFAULT_DEADLINE_S",
    "INTROSPECTION",
    "MAX_REQUEST_BYTES",
    "MOST_DEADLINE_S",
    "PATH",
    "PLAN_KEY",
    "PREFIX",
    "STAGES",
    "AssignRequest",
    "Assignment",
    "Cell",
    "Certificate",
    "CertifyRequest",
    "Conformance",
    "ContourRequest",
    "CriticalKind",
    "CriticalPoint",
    "DangerZone",
    "DecomposeRequest",
    "Decomposition",
    "Draw",
    "DroppedPart",
    "Endpoint",
    "FloatArray",
    "FreeSpace",
    "HeadingScore",
    "HotSpot",
    "LeftSpot",
    "Measures",
    "Message",
    "Method",
    "MissionKey",
    "MissionState",
    "MissionStatus",
    "PathPlan",
    "PathRequest",
    "Per",
    "Place",
    "Role",
    "Share",
    "Sortie",
    "SpacingStep",
    "Track",
    "Variogram",
    "VariogramModel",
    "Vehicle",
    "WeightedArea",
    "any_introspection_key",
    "any_layer_key",
    "checked_id",
    "introspection_key",
    "layer_key",
    "live_key",
    "live_service",
    "mission_key",
    "require_area",
    "require_finite",
]
