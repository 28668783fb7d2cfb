# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `validate`: simulate a recording with an identified model."""

import argparse
import json
import math
from collections.abc import Sequence

from valve_friction_ros import figures
from valve_friction_ros.commands.arguments import require_outputs
from valve_friction_ros.commands.arguments.identification import read_estimate
from valve_friction_ros.commands.arguments.recording import described, read_one
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.rendering import plain
from valve_friction_ros.identification.steps.validation import (
    Validation,
    identified_model,
    validate,
)
from valve_friction_ros.identification.trust.verdict import LEAST_FIT
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.outside_text import printable
from valve_friction_ros.wording import percentage


def _poor(validation: Validation, least: float) -> str:
    """Return a message on a poor fit with the remedy; empty if the fit is good."""
    if validation.fit >= least:
        return ""
    return (
        f"poor: the model reproduces less than {100 * least:g} % of this movement: the valve has "
        "changed, or the estimate comes from another valve or a poor record; identify this "
        "recording too, and compare both results"
    )


def _print(validation: Validation, valve: Valve, notes: Sequence[str], poor: str) -> None:
    share = valve.share_of_travel(validation.rms)
    of_travel = f", {percentage(share)} of travel" if math.isfinite(share) else ""
    print(f"fit {100 * validation.fit:.2f} %  (1 − ‖y − ŷ‖ / ‖y − ȳ‖)")
    if poor:
        print(poor)
    print(f"rms error {validation.rms * 1e6:.3g} µm{of_travel}")
    print(f"largest error {validation.maximum_error * 1e6:.3g} µm")
    for note in notes:
        print(f"note: {printable(note)}")


def run(options: argparse.Namespace) -> int:
    """Validate the model, print how well it fits the recording, and plot both."""
    description, reading = described(options.file, options.valve, options)
    valve = description.valve
    estimate = read_estimate(options.estimate)
    try:
        model = identified_model(estimate, description.known)
    except (RefusalError, ValueError) as error:
        raise type(error)(f"{options.estimate}: {error}") from None
    require_outputs(picture=options.plot)
    recorded = read_one(options.file, valve, reading)
    recording = recorded.recording()
    try:
        validation = validate(recording, valve, model.parameters)
    except RefusalError as refusal:
        raise recorded.refused(refusal) from None
    notes, least = (*recorded.notes, *model.notes), options.fail_below
    poor = _poor(validation, max(LEAST_FIT, least or 0.0))
    try:
        if options.json:
            shown = {
                "fit": validation.fit,
                "poor": poor or None,
                "rms": validation.rms,
                "rms_share_of_travel": plain(valve.share_of_travel(validation.rms)),
                "maximum_error": validation.maximum_error,
                "samples": len(validation.recording),
                "sample_period": validation.recording.sample_period,
                "parameters": vars(model.parameters),
                "notes": list(notes),
            }
            print(json.dumps(shown, ensure_ascii=False, allow_nan=False))
        else:
            _print(validation, valve, notes, poor)
    finally:  # a closed output must not prevent the picture, nor a full disk the numbers
        if options.plot is not None:
            figures.save_picture(figures.validation_figure(validation, valve), options.plot)
    return ExitCode.ALARM if least is not None and validation.fit < least else ExitCode.DONE
