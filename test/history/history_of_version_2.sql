PRAGMA application_id = 1447449160;
PRAGMA user_version = 2;
BEGIN TRANSACTION;
CREATE TABLE baseline (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    since_ns INTEGER NOT NULL,
    coulomb_friction REAL NOT NULL CHECK (coulomb_friction > 0),
    half_width REAL NOT NULL CHECK (half_width >= 0)
);
INSERT INTO "baseline" VALUES(1,1,1790000000000000005,1790000000000000000,140.0,2.0);
INSERT INTO "baseline" VALUES(2,2,1790000000000000009,1790000000000000008,600.0,7.0);
CREATE TABLE identification (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    begin_ns INTEGER,
    end_ns INTEGER,
    method TEXT NOT NULL,
    refusal TEXT,
    fit REAL,
    rms REAL,
    systematic_misfit REAL,
    warnings TEXT NOT NULL,
    level INTEGER NOT NULL CHECK (level BETWEEN 0 AND 2),
    status_signal TEXT NOT NULL,
    message TEXT NOT NULL,
    ratio REAL,
    ratio_low REAL,
    ratio_high REAL,
    baseline REAL,
    baseline_half_width REAL,
    warn_ratio REAL NOT NULL,
    error_ratio REAL NOT NULL,
    low_ratio REAL NOT NULL,
    settings_id INTEGER NOT NULL REFERENCES settings,
    software_version TEXT NOT NULL
);
INSERT INTO "identification" VALUES(1,1,1790000000000000000,1789999940000000000,1790000000000000000,'refined',NULL,0.99,1.0e-05,1.0e-06,'',0,'','friction normal: so',NULL,NULL,NULL,NULL,NULL,1.25,2.0,0.5,1,'0.1.0');
INSERT INTO "identification" VALUES(2,1,1790086400000000000,1790086340000000000,1790086400000000000,'refined',NULL,0.99,1.0e-05,1.0e-06,'',0,'','friction normal: so',1.5,1.46470752997836495268e+00,1.53614285032946806808e+00,140.0,2.0,1.25,2.0,0.5,1,'0.1.0');
INSERT INTO "identification" VALUES(3,1,1790172800000000000,NULL,NULL,'refined','the stem does not move: move the valve',NULL,NULL,NULL,'',0,'','no estimate: the stem does not move: move the valve',NULL,NULL,NULL,NULL,NULL,1.25,2.0,0.5,1,'0.1.0');
CREATE TABLE parameter (
    identification_id INTEGER NOT NULL REFERENCES identification ON DELETE CASCADE,
    name TEXT NOT NULL,
    value REAL,
    standard_error REAL,
    half_width REAL,
    verdict TEXT NOT NULL,
    reason TEXT NOT NULL,
    published REAL,
    PRIMARY KEY (identification_id, name)
) WITHOUT ROWID;
INSERT INTO "parameter" VALUES(1,'coulomb_friction',150.0,1.5,3.0,'identified','',NULL);
INSERT INTO "parameter" VALUES(1,'mass',1.0,0.0,0.0,'fixed','assumed',NULL);
INSERT INTO "parameter" VALUES(1,'static_friction',NULL,NULL,NULL,'not identifiable','no slip jump',NULL);
INSERT INTO "parameter" VALUES(2,'coulomb_friction',210.0,2.0,4.0,'identified','',NULL);
INSERT INTO "parameter" VALUES(2,'mass',1.0,0.0,0.0,'fixed','assumed',NULL);
INSERT INTO "parameter" VALUES(2,'static_friction',NULL,NULL,NULL,'not identifiable','no slip jump',NULL);
CREATE TABLE settings (
    id INTEGER PRIMARY KEY,
    content TEXT NOT NULL UNIQUE
);
INSERT INTO "settings" VALUES(1,'{"identification": {"assumed_mass": 1.0, "derivative_window": null, "fixed": {}, "order": 3, "position_bias": null, "resolution": 350, "steps": 330, "timing_uncertainty": null}, "valve": {"diaphragm_area": 0.0445, "pressure_maximum": 250000.0, "pressure_minimum": 0.0, "pressure_reference": 41740.0, "travel": 0.028575}, "window": 60.0}');
CREATE TABLE valve (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    tag TEXT NOT NULL
);
INSERT INTO "valve" VALUES(1,'/fv_101/identifier','FV-101');
INSERT INTO "valve" VALUES(2,'/area_2/lv_7/identifier','LV-7');
CREATE INDEX identification_of_valve ON identification (valve_id, time_ns);
CREATE INDEX baseline_of_valve ON baseline (valve_id, id);
CREATE VIEW friction AS
    SELECT
        identification.id AS id,
        strftime('%Y-%m-%dT%H:%M:%SZ', time_ns / 1000000000, 'unixepoch') AS time,
        valve.name AS valve,
        valve.tag AS tag,
        parameter.value AS coulomb_friction,
        parameter.half_width AS half_width,
        parameter.verdict AS verdict,
        ratio,
        level,
        message,
        refusal
    FROM identification
    JOIN valve ON valve.id = valve_id
    LEFT JOIN parameter
        ON parameter.identification_id = identification.id AND parameter.name = 'coulomb_friction';
COMMIT;
