# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`identify --report`: one page, read as a browser reads it, and shown by one."""

import os
import re
import struct

import numpy as np
import pytest
from browser import chromium
from pages import PNG, PageReader

import valve_friction_ros
from valve_friction_ros.identification import TIMING_UNCERTAINTY
from valve_friction_ros.model import Recording, SensorNoise

BASELINE = ["--baseline-coulomb-friction", "100", "--baseline-half-width", "2"]
WORDS = {
    "mass": "moving mass m [kg]",
    "viscous_friction": "viscous friction F_v [N·s/m]",
    "coulomb_friction": "Coulomb friction F_c [N]",
    "static_friction": "static friction F_s [N]",
    "spring_constant": "spring constant k [N/m]",
    "spring_preload": "spring preload F_0 [N]",
    "sliding_friction": "sliding friction [N]",
}
SECTIONS = [
    "Parameters",
    "Uncertainty budget",
    "Friction compared with its baseline",
    "Record",
    "Valve signature",
    "Friction over speed",
    "Measured and simulated position",
    "Residual",
    "Notes",
    "Settings and versions",
]


@pytest.fixture
def reported(printed, tmp_path, bench_yaml):
    """Function of a recording and options: its page, and the JSON that was printed beside it."""

    def reported(path, *options, valve=("--valve", bench_yaml)):
        page = tmp_path / "report.html"
        answer = printed(path, *valve, *options, "--report", page)
        return PageReader(page.read_text(encoding="utf-8")), answer

    return reported


def shown(value):
    """A number as the page shows it."""
    if value is None:
        return "–"
    return (f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.5g}").replace("-", "−")


def require_parameters(page, answer):
    """Every parameter stands there as JSON has it, and what is withheld shows no number."""
    table = page.table("parameter")
    assert [*table] == [WORDS[name] for name in answer["parameters"]]
    for name, told in answer["parameters"].items():
        value, interval, verdict, *published = table[WORDS[name]]
        assert verdict == ": ".join(filter(None, (told["verdict"], told["reason"])))
        low, high = told["interval"]
        if low is None or not low < high:
            assert (value, interval) == (shown(told["value"]), "–")
        else:
            texts = (value, *interval.split(" to "))
            for text, number in zip(texts, (told["value"], low, high), strict=True):
                rounding = max(0.05 * told["half_width"], 5e-5 * abs(number))
                assert float(text.replace("−", "-")) == pytest.approx(number, abs=rounding, rel=0)
        if answer["method"] == "bench":
            assert published == [shown(told["published"])]


def test_the_page_holds_all_that_was_found(reported, quick_csv):
    page, answer = reported(quick_csv, *BASELINE, "--method", "bench")
    page.require_self_contained()
    assert page.status == ("amber", "!", "Friction has grown", "maintenance required (NE 107: M)")
    assert page.table("friction")["diagnosis"] == (answer["diagnosis"]["message"],)
    assert page.said("h1") == ["Friction of record.csv"]
    assert page.said("h2") == [each for each in SECTIONS if each != "Notes" or answer["warnings"]]
    require_parameters(page, answer)
    assert {entry["verdict"] for entry in answer["parameters"].values()} > {"not identifiable"}
    assert len(page.images) == 7
    assert len(page.of("source")) == 5
    notes = [f"{re.sub(r'(?<= )-(?=[0-9])', '−', told)}." for told in answer["warnings"]]
    assert [text for text in page.said("p") if text in notes] == notes
    assert page.table("setting")["method"] == ("bench",)
    software = page.table("setting")["software"][0].split(", ")
    assert f"valve_friction_ros {valve_friction_ros.__version__}" in software
    assert {"numpy", "scipy", "Python"} < {each.split()[0] for each in software}
    assert page.table("record")["samples"] == ("1000, sampled every 10 ms",)


def test_the_page_of_the_default_method(reported, write_csv, columns_of, quick_record):
    """A noisy record: the uncertainty budget of JSON, and nothing that speaks of another method."""
    noisy = SensorNoise(position=20e-6, pressure=150.0, seed=2).applied_to(quick_record)
    page, answer = reported(write_csv(columns_of(noisy)))
    page.require_self_contained()
    assert answer["method"] == "plant"
    assert page.table("setting")["method"] == ("plant",)
    titles = page.said("h2")
    assert titles.index("Uncertainty budget") == titles.index("Parameters") + 1
    assert {"sliding friction [N]", WORDS["coulomb_friction"]} <= {*page.table("parameter")}
    settings = page.table("setting")
    assert "derivative window" not in settings
    assert settings["timing uncertainty, standard deviation of the lag between the signals"] == (
        f"{TIMING_UNCERTAINTY:g} s, by default",
    )
    words = page.text.lower()
    assert "bench" not in words
    assert "0 samples" not in words.replace("1000 samples", "")


def test_the_page_is_titled_by_the_tag(reported, quick_csv, bench_yaml, tmp_path):
    tagged = tmp_path / "fv.yaml"
    tagged.write_text(f"valve_tag: FV-101\n{bench_yaml.read_text()}")
    page, _ = reported(quick_csv, "--method", "bench", valve=("--valve", tagged))
    assert page.said("h1") == ["Friction of FV-101"]


def test_a_test_that_did_not_move_the_stem_shows_what_held_it(
    call, write_csv, columns_of, quick_record, bench_yaml
):
    pressure, position = np.tile(quick_record.pressure, 2), quick_record.position
    held = np.full(pressure.size, 0.5 * (position.min() + position.max()))
    seized = write_csv(columns_of(Recording(0.01, pressure, held)))
    seized = seized.rename(seized.with_name("seized.csv"))
    healthy = write_csv(columns_of(quick_record))
    options = ("--valve", bench_yaml, "--method", "bench", "--fail-on", "error")
    code, out, err = call(seized, *options, "--baseline-recording", healthy)
    assert (code, out) == (3, "")
    assert "the stem did not move: " in err
    assert "; ERROR: the stem stayed at " in err


@pytest.mark.parametrize(
    ("begin", "zone", "told"),
    [
        (0.0, "", "The record has no date; its file was last changed 2026-07-17 11:00 UTC."),
        (
            1_784_282_400.0,  # 2026-07-17 10:00 UTC
            "Europe/Berlin",
            "Recorded 2026-07-17 12:00 Europe/Berlin; its file was last changed 2026-07-17 13:00 "
            "Europe/Berlin.",
        ),
    ],
)
def test_a_record_has_its_date_or_that_of_its_file(
    reported, write_csv, columns_of, quick_record, begin, zone, told
):
    """In the stated zone."""
    columns = columns_of(quick_record)
    path = write_csv({**columns, "time_s": begin + columns["time_s"]})
    os.utime(path, (1_784_286_000, 1_784_286_000))
    page, _ = reported(path, "--method", "bench", *(["--time-zone", zone] if zone else []))
    assert told in page.said("p")
    assert page.table("setting")["report written"][0].endswith(f" {zone or 'UTC'}")


def test_why_published_values_differ_is_told_beside_them(reported, quick_csv):
    page, answer = reported(quick_csv, "--method", "bench")
    (told,) = (text for text in page.said("p") if text.startswith("Published method: "))
    assert f"faster than δv = {answer['evidence']['threshold']:.3g} m/s" in told
    assert "If the two differ, trust the value, not the published one." in told
    for name, one in answer["parameters"].items():
        if one["published"] is not None and one["half_width"]:
            is_beyond = abs(one["published"] - one["value"]) > one["half_width"]
            pair = f"{WORDS[name].partition(' [')[0]}: {shown(one['published'])} against"
            assert (pair in told) == is_beyond, name
    page, _ = reported(quick_csv, "--method", "published")
    assert not [text for text in page.said("p") if text.startswith("Published method: ")]


def test_the_baseline_of_a_recording_with_its_signature(
    reported, refusal, write_csv, columns_of, quick_record, quick_csv, bench_yaml
):
    """The same record, as healthy valve: the ratio is 1, and both loops are one."""
    page, answer = reported(quick_csv, "--baseline-recording", quick_csv, "--method", "bench")
    assert answer["diagnosis"]["ratio"] == pytest.approx(1.0)
    assert page.status[0] == "green"
    captions = [text for text in page.said("figcaption") if "Grey: the record of the" in text]
    assert len(captions) == 1
    rest = write_csv(columns_of(Recording(0.01, quick_record.pressure, 0 * quick_record.position)))
    told = refusal(rest, "--valve", bench_yaml, "--baseline-recording", rest)
    assert told.startswith(f"{rest}: ")


def test_a_machine_without_a_spring_has_no_residual(reported, write_csv, columns_of, quick_record):
    velocity = np.gradient(quick_record.position)
    force = 30.0 * np.sign(velocity) + 10.0 * velocity / np.abs(velocity).max()
    columns = columns_of(quick_record)
    del columns["pressure_pa"]
    path = write_csv({**columns, "force_n": force})
    page, _ = reported(path, "--fix", "spring_constant=0", valve=())
    page.require_self_contained()
    assert "Residual" not in page.said("h2")
    assert len(page.images) == 3
    assert "drive force [N]" in page.table("record")
    assert not {"diaphragm area S_a", "pressure reference P_ref"} & {*page.table("setting")}


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ("--report r.pdf", "r.pdf: a report is an HTML page: give it a name that ends in .html"),
        ("--report no/r.html", "no/r.html: there is no folder no: create it, or choose another"),
        ("--baseline-half-width 2", "--baseline-half-width: give the baseline itself with --b"),
        ("--baseline-coulomb-friction 0", "baseline_coulomb_friction must be above zero, got 0"),
        ("--baseline-recording a --baseline-half-width 2", "--baseline-recording provides the b"),
    ],
)
def test_what_cannot_be_is_told_before_anything_is_read(refusal, bench_yaml, options, reason):
    """The recording is not even there."""
    assert refusal("missing.csv", "--valve", bench_yaml, *options.split()).startswith(reason)


def test_a_folder_that_cannot_be_written_to(refusal, bench_yaml):
    """Not even root can make a file there."""
    folder = "/proc/self/fd"
    told = refusal("missing.csv", "--valve", bench_yaml, "--report", f"{folder}/report.html")
    assert told.startswith(f"{folder}/report.html: cannot write into {folder}: ")


def test_a_browser_shows_and_prints_it(reported, quick_csv, tmp_path):
    """A browser draws every picture of the page, on the screen and on paper."""
    page, _ = reported(quick_csv, *BASELINE)
    with chromium() as browser:
        seen = browser.new_page(viewport={"width": 900, "height": 3000})
        seen.goto((tmp_path / "report.html").as_uri())
        assert PageReader(seen.content()).lead == page.lead
        shot, printed = seen.screenshot(), seen.pdf()
    assert shot.startswith(PNG)
    assert struct.unpack(">II", shot[16:24]) == (900, 3000)
    assert printed.startswith(b"%PDF-")
    assert len(re.findall(rb"/Subtype */Image", printed)) == len(page.images)
