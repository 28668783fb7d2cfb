# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings in bags: to the last bit where they are whole, else as far as it goes."""

import gzip
import re
import shutil
import sqlite3
import struct
from binascii import crc32

import numpy as np
import pytest
from bags import (
    PRESSURE,
    START,
    STEM,
    messages_of,
    number_message,
    pressure_message,
    stamps_of,
    stem_message,
    storage_file,
    write_bag,
)

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, Recording, Valve
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.recorded_valve import Stretch
from valve_friction_ros.records.recordings import ReadingOptions, holds_force, read_recordings
from valve_friction_ros.streams import RecordBuffer

zstd = pytest.importorskip("backports.zstd")
STORAGES = ["mcap", "sqlite3"]
KINDS = [(s, c) for s in STORAGES for c in ("none", "file", "message")] + [("mcap", "storage")]
PERIOD = 1_000_000


@pytest.fixture(scope="module")
def record():
    """Three seconds at 1 kHz of values that no decimal could carry by accident."""
    random = np.random.default_rng(5)
    return Recording(1e-3, 1e5 + 1e4 * random.random(3000), 0.01 + 0.01 * random.random(3000))


@pytest.fixture(scope="module")
def bag_of(tmp_path_factory, record):
    """Function of storage and compression: a fresh copy of a bag of the record."""
    made = {}

    def bag(storage="mcap", compression="none"):
        if (storage, compression) not in made:
            path = tmp_path_factory.mktemp("made") / "record"
            made[storage, compression] = write_bag(path, messages_of(record), storage, compression)
        return shutil.copytree(
            made[storage, compression], tmp_path_factory.mktemp("copy") / "record"
        )

    return bag


def read(path, **choice):
    return read_recordings(path, BENCH_VALVE, ReadingOptions(topics=TopicChoice(**choice)))


def only(path, **choice):
    (valve,) = read(path, **choice)
    return valve


def assert_equal(found, record, count=None):
    count = len(record) if count is None else count
    np.testing.assert_array_equal(found.pressure, record.pressure[:count])
    np.testing.assert_array_equal(found.position, record.position[:count])
    assert found.sample_period == record.sample_period
    assert found.start_time == START / 1e9


def problem(path, options=None):
    """Message of what is refused: one line that begins with the path."""

    def read_all():
        return [each.recording() for each in read_recordings(path, BENCH_VALVE, options)]

    with pytest.raises((ValueError, RefusalError)) as refusal:
        read_all()
    message = str(refusal.value)
    assert message.startswith(f"{path}")
    assert "\n" not in message
    return message.removeprefix(f"{path}")


class TestWholeBags:
    @pytest.mark.parametrize(("storage", "compression"), KINDS)
    @pytest.mark.parametrize("what", ["folder", "file"])
    def test_to_the_last_bit(self, bag_of, record, storage, compression, what):
        bag = bag_of(storage, compression)
        valve = only(bag if what == "folder" else storage_file(bag))
        assert_equal(valve.recording(), record)
        assert (valve.name, valve.notes) == ("/fv_101", ())

    def test_parts(self, bag_of, record):
        """A stretch; and the last second before the end, as the buffer of the node has it."""
        options = ReadingOptions(stretch=Stretch(begin=0.5, end=1.5))
        (valve,) = read_recordings(bag_of(), BENCH_VALVE, options)
        np.testing.assert_array_equal(valve.recording().position, record.position[500:1501])
        buffer = RecordBuffer(BENCH_VALVE, 1.0)
        for stamp, p, x in zip(stamps_of(record), record.pressure, record.position, strict=True):
            buffer.add_pressure(int(stamp), p)
            buffer.add_position(int(stamp), x)
        expected = buffer.snapshot().recording()
        options = ReadingOptions(stretch=Stretch(last=1.0))
        (valve,) = read_recordings(bag_of(), BENCH_VALVE, options)
        found = valve.recording()
        np.testing.assert_array_equal(found.pressure, expected.pressure)
        np.testing.assert_array_equal(found.position, expected.position)
        assert (found.start_time, len(found)) == (expected.start_time, 1001)
        assert valve.notes == ()

    def test_by_header_stamps_in_the_order_of_recording(self, tmp_path, record):
        """Receive times of two topics cross, and jitter; without an index as with one."""
        one_by_one = sorted(messages_of(record), key=lambda message: message[1], reverse=True)
        bag = write_bag(tmp_path / "bag", one_by_one)
        assert_equal(only(bag).recording(), record)
        without_summary(storage_file(bag))
        assert_equal(only(bag).recording(), record)

    def test_split_in_ten_and_more(self, tmp_path, record):
        """bag_2 comes before bag_10, with or without the metadata."""
        whole = list(messages_of(record))
        folder = tmp_path / "bag"
        folder.mkdir()
        for number in range(12):
            part = write_bag(tmp_path / f"part{number}", whole[number * 500 : (number + 1) * 500])
            storage_file(part).rename(folder / f"bag_{number}.mcap")
        valve = only(folder)
        assert_equal(valve.recording(), record)
        assert valve.notes == (
            "without a metadata.yaml that can be read: took all storage files in the folder",
        )
        names = [f"bag_{number}.mcap" for number in range(12)]
        lines = ["rosbag2_bagfile_information:", f"  relative_file_paths: {names}"]
        (folder / "metadata.yaml").write_text("\n".join(lines))
        shutil.copy(folder / "bag_0.mcap", folder / "bag_0 (copy).mcap")
        valve = only(folder)
        assert_equal(valve.recording(), record)
        assert valve.notes == ("bag_0 (copy).mcap is not in metadata.yaml, and was left out",)
        (folder / "bag_0 (copy).mcap").unlink()
        assert only(folder).notes == ()
        (folder / "bag_11.mcap").unlink()
        valve = only(folder)
        assert_equal(valve.recording(), record, 2750)
        assert valve.notes == ("bag_11.mcap of metadata.yaml is not there",)

    def test_told_by_content(self, bag_of, record):
        bag = bag_of()
        path = storage_file(bag).rename(bag / "record.csv")
        assert_equal(only(path).recording(), record)

    def test_big_endian_and_surplus_bytes(self, tmp_path, record):
        """As other machines write, and as rclpy's serialisation may."""
        times = zip(stamps_of(record), record.pressure, record.position, strict=True)
        messages = [
            message
            for stamp, p, x in times
            for message in (
                ("/p", PRESSURE, stamp, pressure_message(stamp, p) + bytes(range(12))),
                ("/x", STEM, stamp, stem_message(stamp, x, little_endian=False)),
            )
        ]
        assert_equal(only(write_bag(tmp_path / "bag", messages)).recording(), record)

    def test_range_of_the_sensor(self, bag_of):
        path = bag_of()
        (valve,) = read_recordings(path, Valve(0.0445, pressure_maximum=1.05e5))
        with pytest.raises(RefusalError, match=r"outside the sensor's range -inf to 105000 Pa \("):
            valve.recording()

    def test_a_bag_is_no_force(self, bag_of):
        assert not holds_force(bag_of(), ReadingOptions())


def with_pressure(*changes):
    """Messages of a short record, with the pressures of these samples replaced by messages."""
    replaced = dict(changes)
    for number in range(50):
        stamp = START + number * PERIOD
        data = replaced.get(number, pressure_message(stamp, 1e5 + number))
        yield "/fv_101/actuator_pressure", PRESSURE, stamp, data
        yield "/fv_101/stem_state", STEM, stamp, stem_message(stamp, 0.01 + 1e-4 * number)


class TestBadSamples:
    def test_rejected_as_by_the_node(self, tmp_path):
        again = pressure_message(START + 9 * PERIOD, 1e5)
        bag = write_bag(tmp_path / "bag", with_pressure((10, again), (20, again[:4] + b"\0" * 40)))
        assert problem(bag) == (
            ", /fv_101: bad samples: actuator_pressure repeats a time stamp (1 samples): use a "
            "stretch of the record without them; 1 messages of /fv_101/actuator_pressure cannot "
            "be decoded as its type, and were left out"
        )

    def test_not_finite(self, tmp_path):
        nan = pressure_message(START + 10 * PERIOD, np.nan)
        bag = write_bag(tmp_path / "bag", with_pressure((10, nan)))
        assert "bad samples: actuator_pressure is not finite (1 samples)" in problem(bag)
        before = ReadingOptions(stretch=Stretch(end=0.0095))
        (valve,) = read_recordings(bag, BENCH_VALVE, before)
        assert len(valve.recording()) == 10

    def test_time_that_jumped(self, tmp_path, record):
        """What came before is forgotten, as the node forgets it; a note says so."""
        again = [one for one in messages_of(record) if one[2] >= START + 1000 * PERIOD]
        bag = write_bag(tmp_path / "bag", [*messages_of(record), *again])
        without_summary(storage_file(bag))  # else the reader sorts by the time of receipt
        valve = only(bag)
        # The sample that tells of the jump is forgotten with the others.
        np.testing.assert_array_equal(valve.recording().position, record.position[1001:])
        (note,) = valve.notes
        assert note == (
            "the time stamps of actuator_pressure jumped back by 2 s: data recorded before that "
            "was left out"
        )

    def test_undecodable(self, tmp_path):
        bag = write_bag(tmp_path / "bag", with_pressure((10, b"\0\1\0\0abc"), (20, b"{}")))
        valve = only(bag)
        assert len(valve.recording()) == 50
        assert valve.notes == (
            "2 messages of /fv_101/actuator_pressure cannot be decoded as its type, and were left "
            "out",
        )

    def test_gap(self, tmp_path):
        def without(begin, end):
            kept = (m for m in with_pressure() if not begin < (m[2] - START) / PERIOD < end)
            return write_bag(tmp_path / f"to_{end}", kept)

        recording = only(without(10, 30)).recording()
        assert recording.gap == (
            "gap of 0.02 s in /fv_101/actuator_pressure, 0.010 s after its first sample: use a "
            "stretch without it (--begin, --end)"
        )
        assert len(recording) == 50
        assert recording.stamped.drive.time.size == 31
        assert problem(without(10, 40)).startswith(", /fv_101: gap of 0.03 s in /fv_101/actuator_p")

    def test_one_topic_is_silent(self, tmp_path):
        messages = list(with_pressure())
        bag = write_bag(tmp_path / "bag", [messages[1], *messages[::2]])
        assert problem(bag) == (
            ", /fv_101: only one sample of /fv_101/stem_state: "
            "check that it is sampled, and that it changes"
        )


def without_summary(path):
    """Rewrite the end of an MCAP file as a recorder that keeps no index leaves it."""
    content = path.read_bytes()
    (summary,) = struct.unpack("<Q", content[-28:-20])
    footer = struct.pack("<BQQQI", 2, 20, 0, 0, 0)
    path.write_bytes(content[:summary] + footer + b"\x89MCAP0\r\n")


def with_checksums(path):
    """Fill in the checksums of the two chunks of an MCAP file; return where they end."""
    content, place, ends = bytearray(path.read_bytes()), 8, []
    while content[place] != 0x0F:
        opcode, length = struct.unpack_from("<BQ", content, place)
        if opcode == 0x06:
            (size,) = struct.unpack_from("<I", content, place + 37)
            data = bytes(content[place + 49 + size : place + 9 + length])
            raw = zstd.decompress(data) if size else data
            struct.pack_into("<I", content, place + 33, crc32(raw))
            ends.append(place + 9 + length)
        place += 9 + length
    path.write_bytes(content)
    return ends


def cut(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])


class TestDamagedBags:
    """What can be read is read, and a note says that there was more."""

    @pytest.mark.parametrize("text", [None, "rosbag2_bagfile_information: ["])
    def test_without_metadata_that_can_be_read(self, bag_of, record, text):
        bag = bag_of("sqlite3")
        (bag / "metadata.yaml").unlink()
        if text is not None:
            (bag / "metadata.yaml").write_text(text)
        assert_equal(only(bag).recording(), record)

    @pytest.mark.parametrize("compression", ["none", "message", "storage"])
    def test_mcap_without_summary(self, bag_of, record, compression):
        bag = bag_of("mcap", compression)
        without_summary(storage_file(bag))
        valve = only(bag)
        assert_equal(valve.recording(), record)
        assert valve.notes == ()

    @pytest.mark.parametrize(("storage", "compression"), KINDS)
    @pytest.mark.parametrize("share", [0.4, 0.9])
    def test_cut_off(self, bag_of, record, storage, compression, share):
        """A beginning of the record, to the last bit, and most of what the file still holds."""
        bag = bag_of(storage, compression)
        file = storage_file(bag)
        cut(file, share)
        valve = only(bag)
        found = valve.recording()
        assert_equal(found, record, len(found))
        assert len(found) > 0.4 * share * len(record)
        (note,) = valve.notes
        assert note.startswith(f"{file.name} is truncated or damaged (")
        assert note.endswith("): it was read as far as possible")

    def test_sqlite_without_the_way_to_its_rows(self, tmp_path):
        """So long a table that its inner pages, which lead to the rows, are behind the cut."""
        count = 15_000
        long = Recording(0.001, 1e5 + np.arange(count), 1e-6 * np.arange(count))
        bag = write_bag(tmp_path / "long", messages_of(long), "sqlite3")
        cut(storage_file(bag), 0.3)
        valve = only(bag)
        with pytest.raises(RefusalError, match="no samples of /fv_101/actuator_pressure"):
            valve.recording()
        (note,) = valve.notes
        pages = re.search(r"it holds (\d+) of (\d+) pages", note)
        assert int(pages[1]) == int(0.3 * int(pages[2]))

    def test_a_row_longer_than_a_page(self, tmp_path, record):
        """Between the samples is a message that goes on over several pages of SQLite."""
        messages = [*messages_of(record)]
        text = ("/note", STEM, START, bytes(20_000))
        middle = len(messages) // 2
        bag = write_bag(
            tmp_path / "long", [*messages[:middle], text, *messages[middle:]], "sqlite3"
        )
        valves = {"valve": "fv_101", "pressure": "actuator_pressure", "stem": "stem_state"}
        assert_equal(only(bag, **valves).recording(), record)
        cut(storage_file(bag), 0.7)
        found = only(bag, **valves).recording()
        assert_equal(found, record, len(found))
        assert len(found) > 0.6 * len(record)

    def test_a_cut_page_is_not_filled_up_with_zeros(self, bag_of, record):
        """Wherever in a page of SQLite the file ends, every sample is one of the record."""
        file = storage_file(bag_of("sqlite3"))
        content = file.read_bytes()
        lengths = set()
        for size in range(len(content) // 2, len(content) // 2 + 8192, 191):
            file.write_bytes(content[:size])
            valve = only(file)
            found = valve.recording()
            assert_equal(found, record, len(found))
            assert len(valve.notes) == 1
            lengths.add(len(found))
        assert 1 < len(lengths) <= 4  # one for each whole page

    @pytest.mark.parametrize("compression", ["none", "storage"])
    def test_a_damaged_chunk_of_mcap(self, tmp_path, record, compression):
        """Nothing of it is believed, nor what follows it."""
        names = ("/fv_1", "/fv_2", "/fv_3")
        messages = [message for name in names for message in messages_of(record, name)]
        bag = write_bag(tmp_path / "bag", messages, "mcap", compression)
        _, end = with_checksums(storage_file(bag))
        assert [valve.notes for valve in read(bag)] == [(), (), ()]
        content = bytearray(storage_file(bag).read_bytes())
        content[end - 1] ^= 0x01
        storage_file(bag).write_bytes(content)
        *whole, part = read(bag)
        for valve in whole:
            assert_equal(valve.recording(), record)
        found = part.recording()
        assert 0 < len(found) < len(record)
        assert_equal(found, record, len(found))
        (note,) = part.notes
        assert re.fullmatch(
            r"bag\.mcap is truncated or damaged \(.*\): it was read as far as possible", note
        )

    def test_a_write_ahead_log_is_read(self, bag_of, record):
        """As a killed recorder leaves it that uses one."""
        bag = bag_of("sqlite3")
        file = storage_file(bag)
        with sqlite3.connect(file) as database:
            database.execute("PRAGMA journal_mode = WAL")
            database.execute("PRAGMA wal_autocheckpoint = 0")
            rows = database.execute("SELECT topic_id, timestamp, data FROM messages").fetchall()
            database.execute("DELETE FROM messages WHERE id > 4000")
            database.commit()
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            database.executemany(
                "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", rows[4000:]
            )
            database.commit()
            left = bag.with_name("left")
            shutil.copytree(bag, left)
        database.close()
        assert (left / f"{file.name}-wal").exists()
        valve = only(left)
        assert_equal(valve.recording(), record)
        assert valve.notes == (
            "record.db3 is truncated or damaged (it was not closed by its recorder): it was read "
            "as far as possible",
        )

    def test_zeros_at_the_end(self, bag_of, record):
        """What a loss of power leaves of a file whose size was written before its content."""
        file = storage_file(bag_of())
        content = file.read_bytes()
        file.write_bytes(content[: len(content) // 2] + bytes(100_000))
        found = only(file).recording()
        assert_equal(found, record, len(found))


class TestNoBags:
    """One line that says what to do."""

    @pytest.mark.parametrize(
        ("name", "content", "cause"),
        [
            ("record.mcap", b"", "the file is empty: nothing was recorded or copied"),
            ("record.db3", b"", "the file is empty: nothing was recorded or copied"),
            ("record.mcap.zstd", b"", "the file is empty: nothing was recorded or copied"),
            ("a.bag", b"#ROSBAG V2.0\n    ", "a ROS 1 bag: convert it with rosbags-convert"),
            (
                "record.mcap",
                gzip.compress(b"time_s,position_m,pressure_pa\n", mtime=0),
                "neither MCAP nor SQLite3, despite its name: record it again",
            ),
        ],
    )
    def test_no_storage_file(self, tmp_path, name, content, cause):
        path = tmp_path / name
        path.write_bytes(content)
        assert problem(path) == f": {cause}"

    def test_nothing_of_it_is_left(self, bag_of):
        for kind in KINDS:
            file = storage_file(bag_of(*kind))
            file.write_bytes(file.read_bytes()[:60])
            assert ": it cannot be " in problem(file)
            assert problem(file).endswith("copy or record it again")

    def test_no_file_and_folders_without_a_bag(self, tmp_path, bag_of):
        assert problem(tmp_path / "record.mcap") == ": no such file or folder"
        (tmp_path / "notes.txt").write_text("none")
        told = problem(tmp_path)
        assert told.startswith(": not a bag: the folder contains no .mcap or .db3 file")
        bag = bag_of()
        storage_file(bag).unlink()
        (bag / "record.mcap").mkdir()
        assert problem(bag) == ": cannot be read: Is a directory"

    def test_bag_without_topics(self, tmp_path):
        for storage in STORAGES:
            bag = write_bag(tmp_path / storage, [], storage)
            assert problem(bag) == ": the bag is empty: the recorder received no messages"

    def test_topics_without_messages(self, tmp_path):
        file = storage_file(write_bag(tmp_path / "bag", list(with_pressure())[:2], "sqlite3"))
        with sqlite3.connect(file) as database:
            database.execute("DELETE FROM messages")
        database.close()
        assert problem(file).startswith(", /fv_101: no samples of /fv_101/actuator_pressure")

    @pytest.mark.parametrize("profile", ["", "ros1"])
    def test_mcap_of_something_else(self, bag_of, profile):
        """Nothing of its topics is of a type of ROS 2."""
        file = storage_file(bag_of())
        header = struct.pack("<BQI", 1, 8 + len(profile), len(profile)) + profile.encode()
        file.write_bytes(b"\x89MCAP0\r\n" + header + bytes(4))
        assert problem(file).startswith(": it cannot be read (record.mcap: ")

    def test_another_database(self, tmp_path):
        file = tmp_path / "history.db3"
        with sqlite3.connect(file) as database:
            database.execute("CREATE TABLE topics (name TEXT)")
        database.close()
        assert problem(file).startswith(": it cannot be read (history.db3: ")

    def test_no_topics_of_the_wanted_types(self, tmp_path):
        message = ("/level", "std_msgs/msg/Float64", START, number_message(1.0))
        assert problem(write_bag(tmp_path / "bag", [message])) == (
            f": no {PRESSURE} topic in it; it holds /level (std_msgs/msg/Float64): record the "
            "valve's topics"
        )


class TestSeveralValves:
    @pytest.fixture
    def fleet(self, tmp_path, record):
        """Three valves at once, of which the last lacks its stem."""
        streams = [
            list(messages_of(record)),
            list(messages_of(Recording(1e-3, record.pressure[::-1], record.position), "/fv_102")),
            [message for message in messages_of(record, "/area/fv_9") if message[1] == PRESSURE],
            [("/weather/air", PRESSURE, START, pressure_message(START, 101325.0))],
        ]
        messages = sorted(
            (message for stream in streams for message in stream), key=lambda message: message[2]
        )
        return write_bag(tmp_path / "fleet", messages)

    def test_one_by_one(self, fleet, record):
        found = {valve.name: valve for valve in read(fleet)}
        assert list(found) == ["/area/fv_9", "/fv_101", "/fv_102"]
        assert_equal(found["/fv_101"].recording(), record)
        np.testing.assert_array_equal(found["/fv_102"].recording().pressure, record.pressure[::-1])
        with pytest.raises(RefusalError) as refusal:
            found["/area/fv_9"].recording()
        assert str(refusal.value) == (
            f"{fleet}, /area/fv_9: no {STEM} topic beside /area/fv_9/actuator_pressure"
        )

    @pytest.mark.parametrize("name", ["fv_102", "/fv_102", "fv_102/"])
    def test_one_of_them(self, fleet, name):
        assert only(fleet, valve=name).name == "/fv_102"

    def test_none_of_them(self, fleet):
        options = ReadingOptions(topics=TopicChoice(valve="fv_103"))
        assert problem(fleet, options) == (
            ": no valve /fv_103 in it; it holds /area/fv_9, /fv_101, /fv_102"
        )

    def test_by_topics(self, fleet, record):
        """Whatever their namespaces; nothing else is a valve then."""
        valve = only(fleet, pressure="/area/fv_9/actuator_pressure", stem="/fv_101/stem_state")
        assert valve.name == "/"
        assert_equal(valve.recording(), record)
        assert only(fleet, pressure="/fv_102/actuator_pressure").name == "/fv_102"

    def test_by_names_in_each_namespace(self, tmp_path, record):
        messages = [
            message
            for name in ("/a", "/b/c")
            for message in messages_of(record, name, "io/pressure", "io/stem")
        ]
        bag = write_bag(tmp_path / "bag", messages)
        found = read(bag, pressure="io/pressure", stem="io/stem")
        assert [valve.name for valve in found] == ["/a", "/b/c"]
        for valve in found:
            assert_equal(valve.recording(), record)


class TestJoints:
    def bag(self, path, *names):
        messages = list(with_pressure())
        for number, (topic, kind, stamp, _) in enumerate(messages):
            if kind == STEM:
                positions = [0.01 + 1e-4 * number + joint for joint in range(max(1, len(names)))]
                data = stem_message(stamp, *positions, names=names)
                messages[number] = (topic, kind, stamp, data)
        return write_bag(path, messages)

    @pytest.mark.parametrize(
        ("names", "asked", "index"),
        [
            ((), None, 0),
            (("plug",), None, 0),
            (("knob", "stem"), None, 1),
            (("knob", "plug"), "plug", 1),
            (("knob", "plug"), "", 0),
        ],
    )
    def test_choice(self, tmp_path, names, asked, index):
        found = only(self.bag(tmp_path / "bag", *names), joint=asked).recording()
        assert found.position[0] == pytest.approx(0.0101 + index, abs=1e-12)

    @pytest.mark.parametrize(
        ("asked", "cause"),
        [
            (None, "several joints (knob, plug): specify which joint is the stem"),
            ("stem", "no joint 'stem' among knob, plug"),
        ],
    )
    def test_none_of_them(self, tmp_path, asked, cause):
        options = ReadingOptions(topics=TopicChoice(joint=asked))
        told = problem(self.bag(tmp_path / "bag", "knob", "plug"), options)
        assert told == f", /fv_101: /fv_101/stem_state: {cause}"
