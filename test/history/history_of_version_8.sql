PRAGMA application_id = 1447449160;
PRAGMA user_version = 8;
BEGIN TRANSACTION;
CREATE TABLE alarm_recording (
	valve_id INTEGER NOT NULL, 
	time_ns INTEGER NOT NULL, 
	level INTEGER NOT NULL, 
	path TEXT NOT NULL, 
	message TEXT NOT NULL, 
	PRIMARY KEY (valve_id, path), 
	CHECK (level BETWEEN 0 AND 2), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "alarm_recording" VALUES(1,1790000000000000000,2,'/alarms/1','excess friction');
INSERT INTO "alarm_recording" VALUES(2,1790000000000000000,2,'/alarms/1','excess friction');
CREATE TABLE answer (
	id INTEGER NOT NULL, 
	valve_id INTEGER NOT NULL, 
	travel REAL NOT NULL, 
	stamp INTEGER NOT NULL, 
	change REAL NOT NULL, 
	held REAL NOT NULL, 
	moved INTEGER NOT NULL, 
	settled INTEGER NOT NULL, 
	dead_time REAL, 
	t63 REAL, 
	t86 REAL, 
	overshoot REAL, 
	steady_error REAL, 
	deviation REAL, 
	high_deviation REAL, 
	pressure_delay REAL, 
	pressure_t86 REAL, 
	push REAL, 
	pressure REAL, 
	position REAL, 
	rested INTEGER NOT NULL, 
	pressure_rested INTEGER NOT NULL, 
	at_stop INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CHECK (moved IN (0, 1) AND settled IN (0, 1) AND rested IN (0, 1) AND pressure_rested IN (0, 1) AND at_stop IN (0, 1)), 
	UNIQUE (valve_id, stamp), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
);
INSERT INTO "answer" VALUES(1,1,0.02,1790000001000000000,0.125,0.125,1,1,0.25,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,1,1,1);
INSERT INTO "answer" VALUES(2,1,0.02,1790000002000000000,0.125,0.125,1,1,NULL,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,1,1,1);
INSERT INTO "answer" VALUES(3,1,0.02,1790000000000000000,0.125,0.125,1,1,0.25,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,1,1,1);
INSERT INTO "answer" VALUES(4,2,0.02,1790000001000000000,0.125,0.125,1,1,0.25,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,1,1,1);
INSERT INTO "answer" VALUES(5,2,0.02,1790000002000000000,0.125,0.125,1,1,NULL,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,1,1,1);
INSERT INTO "answer" VALUES(6,2,0.02,1790000000000000000,0.125,0.125,1,1,0.25,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,1,1,1);
CREATE TABLE baseline (
	id INTEGER NOT NULL, 
	valve_id INTEGER NOT NULL, 
	time_ns INTEGER NOT NULL, 
	since_ns INTEGER NOT NULL, 
	coulomb_friction REAL, 
	half_width REAL NOT NULL, 
	sliding_friction REAL, 
	sliding_half_width REAL, 
	sliding_speed REAL, 
	set_by TEXT DEFAULT 'set_baseline' NOT NULL, 
	level INTEGER, 
	withdrawn INTEGER DEFAULT 0 NOT NULL, 
	replaced_coulomb_friction REAL, 
	replaced_half_width REAL, 
	replaced_sliding_friction REAL, 
	replaced_sliding_half_width REAL, 
	replaced_sliding_speed REAL, 
	uid TEXT, 
	PRIMARY KEY (id), 
	CHECK (coulomb_friction > 0 AND half_width >= 0 AND sliding_friction > 0 AND sliding_half_width >= 0 AND sliding_speed > 0), 
	CHECK (coalesce(coulomb_friction, sliding_friction) IS NOT NULL), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
);
INSERT INTO "baseline" VALUES(1,1,1790000000000000000,1790000000000000000,150.0,0.0,NULL,NULL,NULL,'set_baseline',NULL,0,NULL,NULL,NULL,NULL,NULL,'2207907b2e9143e8a59ddea291cbb5d3');
INSERT INTO "baseline" VALUES(2,1,1790000000000000003,1790000000000000000,140.0,2.0,205.5,3.25,0.0095,'set_baseline',1,0,150.0,0.0,NULL,NULL,NULL,'dc475ed0ee3e433e894ae14cd247966c');
INSERT INTO "baseline" VALUES(3,2,1790000000000000000,1790000000000000000,150.0,0.0,NULL,NULL,NULL,'set_baseline',NULL,0,NULL,NULL,NULL,NULL,NULL,'613f2e38d7a34b308cff44a09d86e410');
INSERT INTO "baseline" VALUES(4,2,1790000000000000003,1790000000000000000,140.0,2.0,205.5,3.25,0.0095,'set_baseline',1,0,150.0,0.0,NULL,NULL,NULL,'899d7bfe9090472799e6007973285447');
CREATE TABLE baseline_number (
	baseline_id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	value REAL NOT NULL, 
	half_width REAL NOT NULL, 
	PRIMARY KEY (baseline_id, name), 
	FOREIGN KEY(baseline_id) REFERENCES baseline (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO "baseline_number" VALUES(2,'lag',-0.002,0.003);
INSERT INTO "baseline_number" VALUES(2,'spring_constant',205000.0,40.0);
INSERT INTO "baseline_number" VALUES(4,'lag',-0.002,0.003);
INSERT INTO "baseline_number" VALUES(4,'spring_constant',205000.0,40.0);
CREATE TABLE baseline_record (
	baseline_id INTEGER NOT NULL, 
	sample_period REAL NOT NULL, 
	driven_by TEXT NOT NULL, 
	drive BLOB NOT NULL, 
	position BLOB NOT NULL, 
	PRIMARY KEY (baseline_id), 
	FOREIGN KEY(baseline_id) REFERENCES baseline (id) ON DELETE CASCADE
);
INSERT INTO "baseline_record" VALUES(2,0.01,'PRESSURE',X'0050C3470082C34700B4C34700E6C3470018C447004AC447007CC44700AEC44700E0C4470012C5470044C5470076C54700A8C54700DAC547000CC647003EC6470070C64700A2C64700D4C6470006C7470038C747006AC747009CC74700CEC7470000C8470032C8470064C8470096C84700C8C84700FAC847002CC947005EC9470090C94700C2C94700F4C9470026CA470058CA47008ACA4700BCCA4700EECA470020CB470052CB470084CB4700B6CB4700E8CB47001ACC47004CCC47007ECC4700B0CC4700E2CC470014CD470046CD470078CD4700AACD4700DCCD47000ECE470040CE470072CE4700A4CE4700D6CE470008CF47003ACF47006CCF47009ECF4700D0CF470002D0470034D0470066D0470098D04700CAD04700FCD047002ED1470060D1470092D14700C4D14700F6D1470028D247005AD247008CD24700BED24700F0D2470022D3470054D3470086D34700B8D34700EAD347001CD447004ED4470080D44700B2D44700E4D4470016D5470048D547007AD54700ACD54700DED5470010D6470042D6470074D64700A6D647',X'6F12833AFD33833A8A55833A1877833AA698833A34BA833AC2DB833A50FD833ADE1E843A6C40843AFA61843A8883843A16A5843AA4C6843A32E8843AC009853A4E2B853ADB4C853A696E853AF78F853A85B1853A13D3853AA1F4853A2F16863ABD37863A4B59863AD97A863A679C863AF5BD863A83DF863A1101873A9F22873A2C44873ABA65873A4887873AD6A8873A64CA873AF2EB873A800D883A0E2F883A9C50883A2A72883AB893883A46B5883AD4D6883A62F8883AF019893A7E3B893A0B5D893A997E893A27A0893AB5C1893A43E3893AD1048A3A5F268A3AED478A3A7B698A3A098B8A3A97AC8A3A25CE8A3AB3EF8A3A41118B3ACF328B3A5C548B3AEA758B3A78978B3A06B98B3A94DA8B3A22FC8B3AB01D8C3A3E3F8C3ACC608C3A5A828C3AE8A38C3A76C58C3A04E78C3A92088D3A202A8D3AAD4B8D3A3B6D8D3AC98E8D3A57B08D3AE5D18D3A73F38D3A01158E3A8F368E3A1D588E3AAB798E3A399B8E3AC7BC8E3A55DE8E3AE3FF8E3A71218F3AFF428F3A8C648F3A1A868F3AA8A78F3A36C98F3AC4EA8F3A520C903A');
INSERT INTO "baseline_record" VALUES(4,0.01,'PRESSURE',X'0050C3470082C34700B4C34700E6C3470018C447004AC447007CC44700AEC44700E0C4470012C5470044C5470076C54700A8C54700DAC547000CC647003EC6470070C64700A2C64700D4C6470006C7470038C747006AC747009CC74700CEC7470000C8470032C8470064C8470096C84700C8C84700FAC847002CC947005EC9470090C94700C2C94700F4C9470026CA470058CA47008ACA4700BCCA4700EECA470020CB470052CB470084CB4700B6CB4700E8CB47001ACC47004CCC47007ECC4700B0CC4700E2CC470014CD470046CD470078CD4700AACD4700DCCD47000ECE470040CE470072CE4700A4CE4700D6CE470008CF47003ACF47006CCF47009ECF4700D0CF470002D0470034D0470066D0470098D04700CAD04700FCD047002ED1470060D1470092D14700C4D14700F6D1470028D247005AD247008CD24700BED24700F0D2470022D3470054D3470086D34700B8D34700EAD347001CD447004ED4470080D44700B2D44700E4D4470016D5470048D547007AD54700ACD54700DED5470010D6470042D6470074D64700A6D647',X'6F12833AFD33833A8A55833A1877833AA698833A34BA833AC2DB833A50FD833ADE1E843A6C40843AFA61843A8883843A16A5843AA4C6843A32E8843AC009853A4E2B853ADB4C853A696E853AF78F853A85B1853A13D3853AA1F4853A2F16863ABD37863A4B59863AD97A863A679C863AF5BD863A83DF863A1101873A9F22873A2C44873ABA65873A4887873AD6A8873A64CA873AF2EB873A800D883A0E2F883A9C50883A2A72883AB893883A46B5883AD4D6883A62F8883AF019893A7E3B893A0B5D893A997E893A27A0893AB5C1893A43E3893AD1048A3A5F268A3AED478A3A7B698A3A098B8A3A97AC8A3A25CE8A3AB3EF8A3A41118B3ACF328B3A5C548B3AEA758B3A78978B3A06B98B3A94DA8B3A22FC8B3AB01D8C3A3E3F8C3ACC608C3A5A828C3AE8A38C3A76C58C3A04E78C3A92088D3A202A8D3AAD4B8D3A3B6D8D3AC98E8D3A57B08D3AE5D18D3A73F38D3A01158E3A8F368E3A1D588E3AAB798E3A399B8E3AC7BC8E3A55DE8E3AE3FF8E3A71218F3AFF428F3A8C648F3A1A868F3AA8A78F3A36C98F3AC4EA8F3A520C903A');
CREATE TABLE evidence_change (
	valve_id INTEGER NOT NULL, 
	diaphragm_area REAL, 
	pressure_reference REAL NOT NULL, 
	earliest_ns INTEGER NOT NULL, 
	latest_ns INTEGER NOT NULL, 
	ratio REAL NOT NULL, 
	low REAL NOT NULL, 
	high REAL NOT NULL, 
	PRIMARY KEY (valve_id), 
	CHECK (earliest_ns <= latest_ns AND ratio > 0 AND low > 0 AND low <= high), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "evidence_change" VALUES(1,0.0445,41740.0,1790000000000000000,1790086400000000000,1.5,1.4,1.6);
INSERT INTO "evidence_change" VALUES(2,0.0445,41740.0,1790000000000000000,1790086400000000000,1.5,1.4,1.6);
CREATE TABLE evidence_reference (
	valve_id INTEGER NOT NULL, 
	time_ns INTEGER NOT NULL, 
	diaphragm_area REAL, 
	pressure_reference REAL NOT NULL, 
	sliding_friction REAL NOT NULL, 
	half_width REAL NOT NULL, 
	speed REAL NOT NULL, 
	PRIMARY KEY (valve_id), 
	CHECK (sliding_friction > 0 AND half_width >= 0 AND speed > 0), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "evidence_reference" VALUES(1,1790000000000000000,0.0445,41740.0,205.5,3.25,0.0095);
INSERT INTO "evidence_reference" VALUES(2,1790000000000000000,0.0445,41740.0,205.5,3.25,0.0095);
CREATE TABLE identification (
	id INTEGER NOT NULL, 
	valve_id INTEGER NOT NULL, 
	time_ns INTEGER NOT NULL, 
	begin_ns INTEGER, 
	end_ns INTEGER, 
	method TEXT NOT NULL, 
	refusal TEXT, 
	fit REAL, 
	rms REAL, 
	systematic_misfit REAL, 
	warnings TEXT NOT NULL, 
	level INTEGER NOT NULL, 
	status_signal TEXT NOT NULL, 
	message TEXT NOT NULL, 
	ratio REAL, 
	ratio_low REAL, 
	ratio_high REAL, 
	ratio_of TEXT, 
	ratio_speed REAL, 
	baseline REAL, 
	baseline_half_width REAL, 
	baseline_sliding_friction REAL, 
	baseline_sliding_half_width REAL, 
	baseline_sliding_speed REAL, 
	sliding_speed REAL, 
	warn_ratio REAL NOT NULL, 
	error_ratio REAL NOT NULL, 
	low_ratio REAL NOT NULL, 
	settings_id INTEGER NOT NULL, 
	software_version TEXT NOT NULL, 
	uid TEXT, 
	state TEXT, 
	doubt TEXT, 
	alarm_level INTEGER, 
	alarm_status_signal TEXT, 
	alarm_state TEXT, 
	alarm_message TEXT, 
	alarm_time_ns INTEGER, 
	latest_level INTEGER, 
	latest_status_signal TEXT, 
	latest_state TEXT, 
	latest_message TEXT, 
	PRIMARY KEY (id), 
	CHECK (level BETWEEN 0 AND 2), 
	FOREIGN KEY(valve_id) REFERENCES valve (id), 
	FOREIGN KEY(settings_id) REFERENCES settings (id)
);
INSERT INTO "identification" VALUES(1,1,1790000000000000000,1789999940000000000,1790000000000000000,'bench',NULL,0.99,1.0e-05,1.0e-06,'one
two',0,'','friction normal: so',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,1.25,2.0,0.5,1,'0.1.0','a9dc9cf6212747c39efd0cbc8c317c10','UNKNOWN','',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "identification" VALUES(2,1,1790000000000000002,1789999940000000002,1790000000000000002,'bench',NULL,0.99,1.0e-05,1.0e-06,'',0,'','friction normal: so',1.0,0.97788235468044,1.02261790000985097748e+00,'sliding_friction',0.0095,140.0,2.0,205.5,3.25,0.0095,0.0095,1.25,2.0,0.5,1,'0.1.0','ba2c6b9cfe1946bda89d0786618b21b0','NORMAL','',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "identification" VALUES(3,1,1790000000000000004,NULL,NULL,'bench','the stem does not move: move the valve',NULL,NULL,NULL,'',0,'','no estimate: the stem does not move: move the valve',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,1.25,2.0,0.5,1,'0.1.0','4c49a565f5d6407e8bec482d28e45647','UNKNOWN','',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "identification" VALUES(4,2,1790000000000000000,1789999940000000000,1790000000000000000,'bench',NULL,0.99,1.0e-05,1.0e-06,'one
two',0,'','friction normal: so',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,1.25,2.0,0.5,1,'0.1.0','ff1d5ec107694f40a4c7e532b6f052ca','UNKNOWN','',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "identification" VALUES(5,2,1790000000000000002,1789999940000000002,1790000000000000002,'bench',NULL,0.99,1.0e-05,1.0e-06,'',0,'','friction normal: so',1.0,0.97788235468044,1.02261790000985097748e+00,'sliding_friction',0.0095,140.0,2.0,205.5,3.25,0.0095,0.0095,1.25,2.0,0.5,1,'0.1.0','0a863ac34c8946aea1c63711dcf545b7','NORMAL','',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "identification" VALUES(6,2,1790000000000000004,NULL,NULL,'bench','the stem does not move: move the valve',NULL,NULL,NULL,'',0,'','no estimate: the stem does not move: move the valve',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,1.25,2.0,0.5,1,'0.1.0','f74fce8e845843579dcd30cca7724d24','UNKNOWN','',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
CREATE TABLE identification_number (
	identification_id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	value REAL NOT NULL, 
	half_width REAL NOT NULL, 
	PRIMARY KEY (identification_id, name), 
	FOREIGN KEY(identification_id) REFERENCES identification (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO "identification_number" VALUES(2,'lag',-0.002,0.003);
INSERT INTO "identification_number" VALUES(2,'spring_constant',205000.0,40.0);
INSERT INTO "identification_number" VALUES(5,'lag',-0.002,0.003);
INSERT INTO "identification_number" VALUES(5,'spring_constant',205000.0,40.0);
CREATE TABLE keeper (
	valve_id INTEGER NOT NULL, 
	file TEXT NOT NULL, 
	PRIMARY KEY (valve_id), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
CREATE TABLE mark (
	name TEXT NOT NULL, 
	value TEXT NOT NULL, 
	PRIMARY KEY (name)
)
 WITHOUT ROWID

;
INSERT INTO "mark" VALUES('identity','aeabd8eaf22f4f3d8b5cd587519ba6cb');
CREATE TABLE move (
	valve_id INTEGER NOT NULL, 
	end_ns INTEGER NOT NULL, 
	begin_ns INTEGER NOT NULL, 
	diaphragm_area REAL, 
	pressure_reference REAL NOT NULL, 
	start REAL NOT NULL, 
	stop REAL NOT NULL, 
	force REAL NOT NULL, 
	force_rate REAL NOT NULL, 
	speed REAL NOT NULL, 
	onset_force REAL, 
	onset_position REAL, 
	onset_rate REAL, 
	PRIMARY KEY (valve_id, end_ns), 
	CHECK (begin_ns < end_ns AND stop != start AND speed >= 0), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "move" VALUES(1,1790000001000000000,1790000000000000000,0.0445,41740.0,0.001,0.002,500.0,10.0,0.001,NULL,NULL,NULL);
INSERT INTO "move" VALUES(1,1790000013000000000,1790000012000000000,0.0445,41740.0,0.001,0.002,501.0,10.0,0.001,500.0,0.001,20.0);
INSERT INTO "move" VALUES(1,1790000025000000000,1790000024000000000,0.0445,41740.0,0.001,0.002,502.0,10.0,0.001,NULL,NULL,NULL);
INSERT INTO "move" VALUES(1,1790000037000000000,1790000036000000000,0.0445,41740.0,0.001,0.002,503.0,10.0,0.001,500.0,0.001,20.0);
INSERT INTO "move" VALUES(2,1790000001000000000,1790000000000000000,0.0445,41740.0,0.001,0.002,500.0,10.0,0.001,NULL,NULL,NULL);
INSERT INTO "move" VALUES(2,1790000013000000000,1790000012000000000,0.0445,41740.0,0.001,0.002,501.0,10.0,0.001,500.0,0.001,20.0);
INSERT INTO "move" VALUES(2,1790000025000000000,1790000024000000000,0.0445,41740.0,0.001,0.002,502.0,10.0,0.001,NULL,NULL,NULL);
INSERT INTO "move" VALUES(2,1790000037000000000,1790000036000000000,0.0445,41740.0,0.001,0.002,503.0,10.0,0.001,500.0,0.001,20.0);
CREATE TABLE packing_renewal (
	valve_id INTEGER NOT NULL, 
	time_ns INTEGER NOT NULL, 
	PRIMARY KEY (valve_id, time_ns), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "packing_renewal" VALUES(1,1789913600000000000);
INSERT INTO "packing_renewal" VALUES(2,1789913600000000000);
CREATE TABLE parameter (
	identification_id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	value REAL, 
	standard_error REAL, 
	half_width REAL, 
	verdict TEXT NOT NULL, 
	reason TEXT NOT NULL, 
	published REAL, 
	uncalibrated_half_width REAL, 
	PRIMARY KEY (identification_id, name), 
	FOREIGN KEY(identification_id) REFERENCES identification (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO "parameter" VALUES(1,'coulomb_friction',150.123456789,1.66666666666666657414e-01,3.33333333333333314829e-01,'identified','',NULL,NULL);
INSERT INTO "parameter" VALUES(1,'mass',1.0,0.0,0.0,'fixed','assumed',NULL,NULL);
INSERT INTO "parameter" VALUES(1,'static_friction',NULL,NULL,NULL,'not identifiable','no slip jump',NULL,NULL);
INSERT INTO "parameter" VALUES(2,'coulomb_friction',150.0,1.5,3.0,'identified','',NULL,NULL);
INSERT INTO "parameter" VALUES(2,'mass',1.0,0.0,0.0,'fixed','assumed',NULL,NULL);
INSERT INTO "parameter" VALUES(2,'sliding_friction',205.5,1.625,3.25,'identified','',NULL,NULL);
INSERT INTO "parameter" VALUES(2,'static_friction',NULL,NULL,NULL,'not identifiable','no slip jump',NULL,NULL);
INSERT INTO "parameter" VALUES(4,'coulomb_friction',150.123456789,1.66666666666666657414e-01,3.33333333333333314829e-01,'identified','',NULL,NULL);
INSERT INTO "parameter" VALUES(4,'mass',1.0,0.0,0.0,'fixed','assumed',NULL,NULL);
INSERT INTO "parameter" VALUES(4,'static_friction',NULL,NULL,NULL,'not identifiable','no slip jump',NULL,NULL);
INSERT INTO "parameter" VALUES(5,'coulomb_friction',150.0,1.5,3.0,'identified','',NULL,NULL);
INSERT INTO "parameter" VALUES(5,'mass',1.0,0.0,0.0,'fixed','assumed',NULL,NULL);
INSERT INTO "parameter" VALUES(5,'sliding_friction',205.5,1.625,3.25,'identified','',NULL,NULL);
INSERT INTO "parameter" VALUES(5,'static_friction',NULL,NULL,NULL,'not identifiable','no slip jump',NULL,NULL);
CREATE TABLE settings (
	id INTEGER NOT NULL, 
	content TEXT NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "settings" VALUES(1,'{"identification": {"area_uncertainty": 0.0, "assumed": [], "assumed_mass": 1.0, "derivative_window": null, "drive_scale_uncertainty": 0.0, "fixed": {}, "order": 3, "position_bias": null, "position_scale_uncertainty": 0.0, "resolution": 350, "stated": {}, "steps": 330, "timing_uncertainty": null}, "valve": {"diaphragm_area": 0.0445, "pressure_maximum": 250000.0, "pressure_minimum": 0.0, "pressure_reference": 41740.0, "travel": 0.028575}, "window": 60.0}');
CREATE TABLE told_level (
	valve_id INTEGER NOT NULL, 
	level INTEGER NOT NULL, 
	PRIMARY KEY (valve_id), 
	CHECK (level BETWEEN 0 AND 2), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "told_level" VALUES(1,2);
INSERT INTO "told_level" VALUES(2,2);
CREATE TABLE unsent (
	number INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	valve_id INTEGER NOT NULL, 
	part TEXT NOT NULL, 
	"key" TEXT NOT NULL, 
	since INTEGER NOT NULL, 
	refusal TEXT
);
CREATE TABLE usage (
	valve_id INTEGER NOT NULL, 
	renewal_ns INTEGER NOT NULL, 
	day INTEGER NOT NULL, 
	run TEXT NOT NULL, 
	distance REAL NOT NULL, 
	reversals INTEGER NOT NULL, 
	breakaways INTEGER NOT NULL, 
	time_watched_ns INTEGER NOT NULL, 
	histogram_ns TEXT NOT NULL, 
	PRIMARY KEY (valve_id, renewal_ns, day, run), 
	CHECK (distance >= 0 AND reversals >= 0 AND breakaways >= 0 AND time_watched_ns >= 0), 
	FOREIGN KEY(valve_id) REFERENCES valve (id)
)
 WITHOUT ROWID

;
INSERT INTO "usage" VALUES(1,1789913600000000000,20717,'run 1',1.5,4,2,3600000000000,'[3600000000000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]');
INSERT INTO "usage" VALUES(1,1789913600000000000,20717,'run 2',1.5,4,2,3600000000000,'[3600000000000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]');
INSERT INTO "usage" VALUES(1,1789913600000000000,20718,'run 2',1.5,4,2,3600000000000,'[3600000000000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]');
INSERT INTO "usage" VALUES(2,1789913600000000000,20717,'run 1',1.5,4,2,3600000000000,'[3600000000000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]');
INSERT INTO "usage" VALUES(2,1789913600000000000,20717,'run 2',1.5,4,2,3600000000000,'[3600000000000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]');
INSERT INTO "usage" VALUES(2,1789913600000000000,20718,'run 2',1.5,4,2,3600000000000,'[3600000000000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]');
CREATE TABLE valve (
	id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	tag TEXT NOT NULL, 
	PRIMARY KEY (id), 
	UNIQUE (name)
);
INSERT INTO "valve" VALUES(1,'/fv_101/identifier','FV-101');
INSERT INTO "valve" VALUES(2,'/area_2/lv_7/identifier','LV-7');
CREATE UNIQUE INDEX identification_uid ON identification (valve_id, uid);
CREATE INDEX identification_of_valve ON identification (valve_id, time_ns);
CREATE INDEX baseline_of_valve ON baseline (valve_id, id);
CREATE UNIQUE INDEX baseline_uid ON baseline (valve_id, uid);
CREATE UNIQUE INDEX settings_content ON settings (content);
CREATE VIEW friction AS
    SELECT
        identification.id AS id,
        strftime('%Y-%m-%dT%H:%M:%SZ', time_ns / 1000000000, 'unixepoch') AS time,
        valve.name AS valve,
        valve.tag AS tag,
        parameter.value AS coulomb_friction,
        parameter.half_width AS half_width,
        parameter.verdict AS verdict,
        sliding.value AS sliding_friction,
        sliding.half_width AS sliding_half_width,
        sliding.verdict AS sliding_verdict,
        identification.sliding_speed AS sliding_speed,
        ratio,
        ratio_of,
        level,
        message,
        refusal
    FROM identification
    JOIN valve ON valve.id = valve_id
    LEFT JOIN parameter
        ON parameter.identification_id = identification.id AND parameter.name = 'coulomb_friction'
    LEFT JOIN parameter AS sliding
        ON sliding.identification_id = identification.id AND sliding.name = 'sliding_friction';
CREATE INDEX unsent_row ON unsent (valve_id, part, "key");
CREATE TRIGGER unsent_valve_insert AFTER INSERT ON valve BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.id, 'valve', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.id AND part = 'valve' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.id AND part = 'valve' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_valve_update AFTER UPDATE ON valve BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.id, 'valve', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.id AND part = 'valve' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.id AND part = 'valve' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_identification_insert AFTER INSERT ON identification BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'identification', json_array(NEW.uid), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'identification' AND key = json_array(NEW.uid)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'identification' AND key = json_array(NEW.uid) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_baseline_insert AFTER INSERT ON baseline BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'baseline', json_array(NEW.uid), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'baseline' AND key = json_array(NEW.uid)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'baseline' AND key = json_array(NEW.uid) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_packing_renewal_insert AFTER INSERT ON packing_renewal BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'packing_renewal', json_array(NEW.time_ns), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'packing_renewal' AND key = json_array(NEW.time_ns)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'packing_renewal' AND key = json_array(NEW.time_ns) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_usage_insert AFTER INSERT ON usage BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'usage', json_array(NEW.renewal_ns, NEW.day, NEW.run), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'usage' AND key = json_array(NEW.renewal_ns, NEW.day, NEW.run)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'usage' AND key = json_array(NEW.renewal_ns, NEW.day, NEW.run) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_usage_update AFTER UPDATE ON usage BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'usage', json_array(NEW.renewal_ns, NEW.day, NEW.run), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'usage' AND key = json_array(NEW.renewal_ns, NEW.day, NEW.run)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'usage' AND key = json_array(NEW.renewal_ns, NEW.day, NEW.run) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_usage_delete AFTER DELETE ON usage BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'usage', json_array(OLD.renewal_ns, OLD.day, OLD.run), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'usage' AND key = json_array(OLD.renewal_ns, OLD.day, OLD.run)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'usage' AND key = json_array(OLD.renewal_ns, OLD.day, OLD.run) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_alarm_recording_insert AFTER INSERT ON alarm_recording BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'alarm_recording', json_array(NEW.path), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'alarm_recording' AND key = json_array(NEW.path)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'alarm_recording' AND key = json_array(NEW.path) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_alarm_recording_update AFTER UPDATE ON alarm_recording BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'alarm_recording', json_array(NEW.path), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'alarm_recording' AND key = json_array(NEW.path)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'alarm_recording' AND key = json_array(NEW.path) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_alarm_recording_delete AFTER DELETE ON alarm_recording BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'alarm_recording', json_array(OLD.path), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'alarm_recording' AND key = json_array(OLD.path)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'alarm_recording' AND key = json_array(OLD.path) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_told_level_insert AFTER INSERT ON told_level BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'told_level', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'told_level' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'told_level' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_told_level_update AFTER UPDATE ON told_level BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'told_level', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'told_level' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'told_level' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_told_level_delete AFTER DELETE ON told_level BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'told_level', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'told_level' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'told_level' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_move_insert AFTER INSERT ON move BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'move', json_array(NEW.end_ns), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'move' AND key = json_array(NEW.end_ns)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'move' AND key = json_array(NEW.end_ns) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_move_update AFTER UPDATE ON move BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'move', json_array(NEW.end_ns), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'move' AND key = json_array(NEW.end_ns)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'move' AND key = json_array(NEW.end_ns) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_move_delete AFTER DELETE ON move BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'move', json_array(OLD.end_ns), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'move' AND key = json_array(OLD.end_ns)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'move' AND key = json_array(OLD.end_ns) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_evidence_reference_insert AFTER INSERT ON evidence_reference BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'evidence_reference', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_reference' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_reference' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_evidence_reference_update AFTER UPDATE ON evidence_reference BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'evidence_reference', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_reference' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_reference' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_evidence_reference_delete AFTER DELETE ON evidence_reference BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'evidence_reference', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'evidence_reference' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'evidence_reference' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_evidence_change_insert AFTER INSERT ON evidence_change BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'evidence_change', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_change' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_change' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_evidence_change_update AFTER UPDATE ON evidence_change BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'evidence_change', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_change' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'evidence_change' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_evidence_change_delete AFTER DELETE ON evidence_change BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'evidence_change', json_array(), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'evidence_change' AND key = json_array()), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'evidence_change' AND key = json_array() AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_answer_insert AFTER INSERT ON answer BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'answer', json_array(NEW.stamp), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'answer' AND key = json_array(NEW.stamp)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'answer' AND key = json_array(NEW.stamp) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_answer_update AFTER UPDATE ON answer BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT NEW.valve_id, 'answer', json_array(NEW.stamp), coalesce((SELECT min(since) FROM unsent WHERE valve_id = NEW.valve_id AND part = 'answer' AND key = json_array(NEW.stamp)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = NEW.valve_id AND part = 'answer' AND key = json_array(NEW.stamp) AND number < (SELECT max(number) FROM unsent); END;
CREATE TRIGGER unsent_answer_delete AFTER DELETE ON answer BEGIN INSERT INTO unsent (valve_id, part, key, since) SELECT OLD.valve_id, 'answer', json_array(OLD.stamp), coalesce((SELECT min(since) FROM unsent WHERE valve_id = OLD.valve_id AND part = 'answer' AND key = json_array(OLD.stamp)), CAST(strftime('%s', 'now') AS INTEGER)); DELETE FROM unsent WHERE valve_id = OLD.valve_id AND part = 'answer' AND key = json_array(OLD.stamp) AND number < (SELECT max(number) FROM unsent); END;
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('unsent',42);
COMMIT;
