"""Arguments of the commands that identify: the method and its settings."""

import argparse
from collections.abc import Mapping, Sequence

from valve_friction_ros.identification import (
    CALIBRATION,
    DEFAULT_METHOD,
    FIXABLE,
    METHODS,
    TIMING_UNCERTAINTY,
    IdentificationSettings,
)

__all__ = ["add_identification_arguments", "identification_settings"]


def add_identification_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the method and what it takes."""
    defaults = IdentificationSettings()
    parser.add_argument(
        "--method",
        choices=[*METHODS],
        default=DEFAULT_METHOD,
        help="best: robust wherever it applies; robust: imperfections of a plant in the fit; "
        "refined: the Karnopp model alone; published: the paper's model 1; signature: model 2, two "
        "periods or more of a slow triangle (%(default)s)",
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
            default=getattr(defaults, name),
            metavar="SHARE",
            help=f"relative standard uncertainty of {what}, 0.02 for 2 %%: widens every interval "
            "(%(default)g)",
        )
    parser.add_argument(
        "--order",
        type=int,
        default=defaults.order,
        metavar="N",
        help="polynomial order n (%(default)s)",
    )


def _fixed(entries: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    fixed = {}
    for entry in entries:
        name, separator, text = entry.partition("=")
        name = name.strip()
        if name in fixed:
            raise ValueError(f"--fix {name} is given twice")
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


def identification_settings(
    options: argparse.Namespace, known: Mapping[str, float]
) -> IdentificationSettings:
    """Build the settings from the parsed arguments, and from what the valve file names.

    Raises ValueError if they do not go together.
    """
    defaults = IdentificationSettings()
    return IdentificationSettings(
        derivative_window=options.derivative_window,
        order=options.order,
        fixed=_fixed(options.fix, known),
        position_bias=options.position_bias,
        timing_uncertainty=options.timing_uncertainty,
        **{name: getattr(options, name) for name in CALIBRATION},
        assumed_mass=known.get("mass", defaults.assumed_mass),
    )
