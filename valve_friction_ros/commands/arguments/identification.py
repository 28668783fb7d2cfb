"""Arguments of the commands that identify: the method and its settings."""

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from valve_friction_ros.identification import (
    CALIBRATION,
    DEFAULT_METHOD,
    FIXABLE,
    METHOD_NAMES,
    TIMING_UNCERTAINTY,
    IdentificationSettings,
)
from valve_friction_ros.records.spelling import nearest, resembling

if TYPE_CHECKING:
    from valve_friction_ros.records.valve_file import ValveFile

__all__ = ["add_identification_arguments", "identification_settings", "method_name"]


def add_identification_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the method and what it takes."""
    defaults = IdentificationSettings()
    parser.add_argument(
        "--method",
        choices=METHOD_NAMES,
        help="best: robust wherever it applies; robust: imperfections of a plant in the fit; "
        "refined: the Karnopp model alone; published: the paper's model 1; signature: model 2, two "
        f"periods or more of a slow triangle ({DEFAULT_METHOD})",
    )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help=f"take a parameter as known ({', '.join(FIXABLE)}); NAME alone: from the valve file",
    )
    parser.add_argument(
        "--position-bias",
        type=float,
        metavar="M",
        help="x̄ of (10) in m: the paper's form of four columns, F_0 = k·x̄",
    )
    parser.add_argument(
        "--derivative-window",
        type=int,
        metavar="SAMPLES",
        help=f"derivative window d, samples; by default {defaults.published_window} for the "
        "published method, and chosen by the noise of the record for refined and signature; "
        "robust takes no derivatives",
    )
    parser.add_argument(
        "--timing-uncertainty",
        type=float,
        metavar="S",
        help="standard deviation in s of the whole lag between the signals, of the method robust; "
        f"by default {TIMING_UNCERTAINTY:g}",
    )
    for name, what in CALIBRATION.items():
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=float,
            metavar="SHARE",
            help=f"relative standard uncertainty of {what}, 0.02 for 2 %%: widens every interval "
            f"({getattr(defaults, name):g})",
        )
    parser.add_argument(
        "--order",
        type=int,
        metavar="N",
        help=f"polynomial order n ({defaults.order})",
    )


def _fixed(entries: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    fixed = {}
    for entry in entries:
        name, separator, text = entry.partition("=")
        name = name.strip()
        if name in fixed:
            raise ValueError(f"--fix {name} is given twice")
        if name not in FIXABLE and (close := resembling(name, FIXABLE)):
            raise ValueError(
                f"{name[:60]!r} is not a parameter that can be fixed; {nearest(name, close)}"
            )
        if separator:
            try:
                fixed[name] = float(text)
            except ValueError:
                raise ValueError(f"--fix {entry}: {text!r} is not a number") from None
        elif name in known:
            fixed[name] = known[name]
        else:
            raise ValueError(
                f"--fix {name}: give a value, as {name}=VALUE, or a valve file with it"
            )
    return fixed


def method_name(options: argparse.Namespace, described: Mapping[str, Any]) -> str:
    """Return the method that was asked for, or else the valve file's."""
    return str(options.method or described.get("method", DEFAULT_METHOD))


def identification_settings(
    options: argparse.Namespace, described: "ValveFile"
) -> IdentificationSettings:
    """Build the settings from the parsed arguments, and from what the valve file names.

    An option goes before the settings of the valve file. Raises ValueError if they do not go
    together.
    """
    defaults = IdentificationSettings()

    def given(name: str, option: Any) -> Any:
        if option is not None:
            return option
        return described.settings.get(name, getattr(defaults, name, None))

    fixed = {
        name.removeprefix("fixed."): value
        for name, value in described.settings.items()
        if name.startswith("fixed.")
    } | _fixed(options.fix, described.known)
    return IdentificationSettings(
        derivative_window=given("derivative_window", options.derivative_window),
        order=given("polynomial_order", options.order) or defaults.order,
        fixed=fixed,
        stated={name: each for name, each in described.stated.items() if name not in fixed},
        position_bias=given("position_bias", options.position_bias),
        timing_uncertainty=given("timing_uncertainty", options.timing_uncertainty),
        **{name: given(name, getattr(options, name)) for name in CALIBRATION},
        assumed_mass=described.known.get("mass", defaults.assumed_mass),
    )
