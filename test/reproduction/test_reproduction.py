# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The programme of the paper, exact without noise; and the command: what it writes and refuses."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pages import PageReader
from paper import command
from paper.bench import BENCH_NAMES, read_bench
from paper.checks import all_checks, force_terms, summary, within
from paper.experiments import TRIANGLE
from paper.experiments import run as experiment
from paper.programme import progress_steps, rounded_bias

from valve_friction_ros.commands import reproduce_paper
from valve_friction_ros.commands.main import run
from valve_friction_ros.identification import (
    IdentificationSettings,
    identify_signature,
    published_estimate,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    SensorNoise,
    SquareWave,
)

CONFIG = Path(__file__).resolve().parents[2] / "config"
KNOWN = {
    "low": (BENCH_VALVE, LOW_FRICTION),
    "high": (BENCH_VALVE, HIGH_FRICTION),
    "graphite": (GRAPHITE_VALVE, GRAPHITE_PACKING),
}


def bench(name, noise=None):
    found = read_bench(CONFIG, name)
    return found if noise is None else found.with_noise(noise)


@pytest.mark.parametrize("name", BENCH_NAMES)
def test_configured_benches_are_those_of_the_model(name):
    found = bench(name)
    valve, truth = KNOWN[name]
    assert found.valve == valve
    assert vars(found.truth) == pytest.approx(vars(truth), rel=1e-15)
    assert found.square == SquareWave()
    assert found.noise == SensorNoise(1e-6, 5.0)
    assert (found.sample_period, found.converter_lag, found.assumed_mass) == (1e-3, 1.3, 1.6)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("mass: 1.542", "mass: heavy"), "simulator.mass"),
        (("mass: 1.542", "mass: -1.0"), "mass"),
        (("position_noise", "position_nois"), "simulator has no position_noise"),
        (("  pressure_source:", "  source:"), "no parameters of pressure_source"),
        (("sample_rate: 1000.0", "sample_rate: 0.0"), "sample_rate"),
        (("/**:", "/**: ["), "not YAML"),
    ],
)
def test_wrong_bench_files_are_refused_in_one_line(tmp_path, change, told):
    text = (CONFIG / "bench_low.yaml").read_text(encoding="utf-8")
    (tmp_path / "bench_low.yaml").write_text(text.replace(*change), encoding="utf-8")
    with pytest.raises(ValueError, match=told) as raised:
        read_bench(tmp_path, "low")
    assert "bench_low.yaml" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_missing_bench_file_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"bench_high\.yaml: cannot be read"):
        read_bench(tmp_path, "high")


@pytest.mark.parametrize("name", ["low", "high"])
def test_without_noise_model_1_is_the_truth(name):
    """The paper's whole way, x̄ from the triangle included."""
    silent = bench(name, SensorNoise())
    triangle = experiment(silent, TRIANGLE, 2.5 * TRIANGLE.period)
    np.testing.assert_array_equal(triangle.measured.position, triangle.clean.position)
    signature = identify_signature(triangle.measured, silent.valve).signature
    bias = rounded_bias(signature.position_bias)
    assert bias == 1.13e-3
    square = experiment(silent, silent.square, 3 * silent.square.period)
    settings = IdentificationSettings(position_bias=bias, assumed_mass=1.6)
    found = published_estimate(square.measured, silent.valve, settings).values
    for key in ("viscous_friction", "coulomb_friction", "static_friction", "spring_constant"):
        assert found[key] == pytest.approx(getattr(silent.truth, key), rel=1e-4)


def test_a_check_fails_beyond_its_criterion_and_says_why():
    assert within("k", 100.0, 101.0, 0.01, "N/m", "because").matched
    missed = within("k", 100.0, 101.1, 0.01, "N/m", "because")
    assert (missed.matched, missed.why) == (False, "because")
    assert not within("k", 100.0, float("nan"), 0.01, "N/m", "because").matched
    good = within("m", 1.0, 1.0, 0.01, "kg", "because")
    assert summary([good, missed]) == "1 of 2 matched; not matched: k."
    assert summary([good]) == "1 of 1 matched."


def missed(programme):
    return {check.name for check in all_checks(programme) if not check.matched}


def test_what_cannot_match_does_not(reproduced):
    """The paper contradicts itself in k, and its model 2 is not the simulated valve."""
    names = missed(reproduced.programme)
    assert names >= {
        "section 5, lowest pressure of the sine",
        "(16), k of (15), low",
        "Table 1, model 2, low, F_v",
        "Table 1, model 2, high, F_v",
        "Table 1, model 2, high, F_c",
        "Fig. 7, model 2 deviates visibly",
    }
    assert not any(name.startswith(("Fig. 2", "Fig. 5")) for name in names)
    for symbol in ("k", "F_v", "F_c", "F_s"):
        for name in ("low", "high"):
            assert f"Table 1, model 1, {name}, {symbol}" not in names


def with_low(programme, result):
    return replace(programme, results={**programme.results, "low": result})


def test_a_wrong_model_1_would_be_noticed(reproduced):
    programme = reproduced.programme
    low = programme.results["low"]
    published = replace(low.identified.published, coulomb_friction=152.7 * 1.06)
    wrong = replace(low, identified=replace(low.identified, published=published))
    assert missed(with_low(programme, wrong)) - missed(programme) == {"Table 1, model 1, low, F_c"}


def test_a_wrong_winner_would_be_noticed(reproduced):
    programme = reproduced.programme
    low = programme.results["low"]
    swapped = {**low.sine, "model 1": low.sine["model 2"], "model 2": low.sine["model 1"]}
    wrong = replace(low, sine=swapped)
    assert "Fig. 6, model 1 beats model 2" in missed(with_low(programme, wrong))
    assert "Fig. 6, model 1 beats model 2" not in missed(programme)


def test_graphite_is_told_from_teflon(reproduced):
    for name, result in reproduced.programme.results.items():
        model = result.identified.force_balance.model
        assert (model.static_friction > model.coulomb_friction) == (name == "graphite")


def test_terms_add_up_to_the_force_while_the_stem_slides(reproduced):
    result = reproduced.programme.results["high"]
    time, terms = force_terms(result)
    clean = result.experiments.sine.clean
    first = round(time[0] / clean.sample_period)
    force = result.bench.valve.actuator_force(clean.pressure[first : first + time.size])
    # Far from a rest, where the window of the derivatives would reach into it.
    middle = np.abs(terms["F_v·ẋ"]) > 0.8 * np.max(np.abs(terms["F_v·ẋ"]))
    assert np.count_nonzero(middle) > 1000
    residual = (sum(terms.values()) - force)[middle]
    assert np.max(np.abs(residual)) < 0.01 * result.bench.truth.coulomb_friction


def test_progress_is_told_as_often_as_announced(reproduced):
    assert len(reproduced.told) == progress_steps(reproduced.programme.results)


PICTURES = {
    "excitations",
    "figure_2_graphite",
    *(f"figure_{number}" for number in (1, 2, 5, 6, 7, 8, 9)),
    *(f"figure_{number}_{name}" for number in (3, 4) for name in ("low", "high", "graphite")),
    "validation_graphite_sine",
    "validation_graphite_isa",
}


@pytest.fixture(scope="module")
def page(reproduced):
    return PageReader((reproduced.output / "reproduction.html").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_the_report_and_every_figure_are_written(reproduced):
    assert reproduced.code == 0
    names = {path.name for path in reproduced.output.iterdir()}
    assert names == {"reproduction.html", *(f"{name}.png" for name in PICTURES)}
    for name in PICTURES:
        assert (reproduced.output / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_the_last_line_counts_and_names(reproduced):
    checks = all_checks(reproduced.programme)
    missed = [check.name for check in checks if not check.matched]
    count, _, names = reproduced.lines[-1].partition("; not matched: ")
    assert count == f"{len(checks) - len(missed)} of {len(checks)} matched"
    assert names == "; ".join(missed) + "."


def test_every_item_has_its_section_and_its_checks(reproduced, page):
    titles = page.said("h2")
    assert titles[0] == "Not matched"
    assert [title.partition(".")[0] for title in titles[1:]] == [str(n) for n in range(1, 11)]
    checks = all_checks(reproduced.programme)
    assert {check.item for check in checks} == set(range(1, 11))
    missed = [check for check in checks if not check.matched]
    cells = page.said("td")
    assert cells.count("✓") == len(checks) - len(missed)
    assert cells.count("✗") == 2 * len(missed)
    for check in checks:
        assert cells.count(typeset(check.name)) == 1 + (not check.matched)
    assert len(page.images) == len(PICTURES)


def test_the_lead_counts_and_the_first_table_lists(reproduced, page):
    """Twelve items do not belong into a sentence."""
    checks = all_checks(reproduced.programme)
    missed = [check.name for check in checks if not check.matched]
    assert len(missed) > 1
    assert page.lead.endswith(f" {len(checks) - len(missed)} of {len(checks)} matched.")
    assert not any(name in page.lead for name in missed)
    assert [row[1] for row in page.tables[0][1:]] == [typeset(name) for name in missed]


def typeset(text):
    """As the page writes it."""
    return re.sub(r"(?<![\w.-])-(?=\d)", "−", text)


def test_the_noise_of_the_run_is_stated(page):
    assert any("1 µm and 5 Pa (standard deviations), seed 3" in text for text in page.said("p"))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--seed", "-1"], "--seed must not be negative"),
        (["--position-noise-um", "-1"], "--position-noise-um must be finite and not negative"),
        (["--pressure-noise-pa", "nan"], "--pressure-noise-pa must be finite and not negative"),
        (["--config", "nowhere"], "nowhere/bench_low.yaml: cannot be read"),
    ],
)
def test_wrong_options_are_refused_in_one_line(tmp_path, monkeypatch, capsys, arguments, told):
    monkeypatch.chdir(tmp_path)
    assert run(["reproduce-paper", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("valve_friction reproduce-paper: ")
    assert told in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_is_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "taken").write_text("")
    assert run(["reproduce-paper", "--output", str(tmp_path / "taken")]) == 2
    told = f"{tmp_path / 'taken'}: not a folder: give --output another name"
    assert capsys.readouterr().err == f"valve_friction reproduce-paper: {told}\n"


def test_noise_that_hides_everything_is_refused_with_the_packing(tmp_path, capsys):
    options = ["reproduce-paper", "--output", str(tmp_path), "--position-noise-um", "1000"]
    assert run(options) == 2
    refusal = capsys.readouterr().err.splitlines()[-1]
    assert refusal.startswith(
        "valve_friction reproduce-paper: packing low: sampling is too slow for the motion"
    )
    assert list(tmp_path.iterdir()) == []


def test_noise_of_the_command_line_replaces_the_configured(monkeypatch, tmp_path):
    seen = {}

    def refuse(benches, *_):
        seen.update({name: bench.noise for name, bench in benches.items()})
        raise ValueError("enough")

    monkeypatch.setattr(command, "run_programme", refuse)
    options = ["--position-noise-um", "0", "--pressure-noise-pa", "7", "--seed", "4"]
    assert run(["reproduce-paper", "--output", str(tmp_path), *options]) == 2
    assert {(one.position, one.pressure, one.seed) for one in seen.values()} == {(0.0, 7.0, 4)}


def test_an_installation_without_it_says_where_it_is(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(
        reproduce_paper, "__file__", str(tmp_path / "package" / "commands" / "a.py")
    )
    assert run(["reproduce-paper", "--output", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert told.startswith("valve_friction reproduce-paper: the reproduction is not part of the")
    assert told.endswith("where it lies in examples/paper\n")
