"""The tables of the mission service's database, and how older ones are brought up to date."""

from oxbow_mission.database import Schema

__all__ = ["SCHEMA"]

SCHEMA = Schema(
    version=2,
    script="""
CREATE TABLE revision (
    mission_id TEXT NOT NULL,
    revision INTEGER NOT NULL,
    client TEXT NOT NULL DEFAULT '',
    state TEXT NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 0,
    announced INTEGER NOT NULL DEFAULT FALSE,
    error TEXT,
    changed_s REAL NOT NULL,
    accepted_s REAL NOT NULL,
    fingerprint TEXT NOT NULL,
    parameters BLOB NOT NULL,
    document BLOB NOT NULL,
    plan BLOB,
    PRIMARY KEY (mission_id, revision)
) STRICT;
CREATE INDEX unannounced ON revision (state) WHERE NOT announced;
CREATE TABLE report (
    mission_id TEXT NOT NULL,
    received_s REAL NOT NULL,
    payload BLOB NOT NULL
) STRICT;
CREATE INDEX report_of_mission ON report (mission_id);
""",
    upgrades={
        # Schema 1 kept refused requests as revisions, which were none; and counted deaths of the whole service.
        1: """
DELETE FROM revision WHERE state = 'failed' AND length(document) = 0;
ALTER TABLE revision ADD COLUMN client TEXT NOT NULL DEFAULT '';
UPDATE revision SET attempts = 0;
""",
    },
)
