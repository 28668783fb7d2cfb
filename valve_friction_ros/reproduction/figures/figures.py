"""The figures of the report, each with its caption, in the order of the paper."""

from collections.abc import Mapping
from types import MappingProxyType

from matplotlib.figure import Figure

from valve_friction_ros.reports import Picture
from valve_friction_ros.reproduction import paper
from valve_friction_ros.reproduction.checks.validation_checks import FIGURES
from valve_friction_ros.reproduction.figures.model_figures import (
    estimates_figure,
    quality_figure,
    validation_figure,
)
from valve_friction_ros.reproduction.figures.record_figures import (
    excitations_figure,
    force_terms_figure,
    input_output_figure,
    packing_name,
    signatures_figure,
)
from valve_friction_ros.reproduction.programme import Programme

__all__ = ["Pictures", "draw_figures"]

Pictures = Mapping[str, Picture]


def draw_figures(programme: Programme) -> Pictures:
    """Draw every figure, with captions, by the name of its file."""
    low, high, graphite = (programme.results[name] for name in (*paper.PACKINGS, "graphite"))
    figures: dict[str, tuple[Figure, str]] = {
        "excitations": (
            excitations_figure(low),
            "The four excitations as commanded, and behind the V/P converter.",
        ),
        "figure_1": (input_output_figure(low, high), "Fig. 1: input and stem, low and high."),
        "figure_2": (
            signatures_figure(low, high),
            "Fig. 2: valve signatures with the breakaway points P1 (up) and P2 (down) and the "
            "dead zones (arrows).",
        ),
        "figure_2_graphite": (
            signatures_figure(graphite),
            "As Fig. 2, graphite packing: the stem jumps as it breaks away.",
        ),
    }
    for one in (low, high, graphite):
        name = one.bench.name
        shown = packing_name(one) + ("." if name == "low" else " (not in the paper).")
        figures |= {
            f"figure_3_{name}": (estimates_figure(one), f"Fig. 3: estimates over δv, {shown}"),
            f"figure_4_{name}": (
                quality_figure(one),
                f"Fig. 4: σ_s of (17) and R²_s of (18) over δv, {shown}",
            ),
        }
    figures["figure_5"] = (
        force_terms_figure(high),
        "Fig. 5: contribution of each term of (4), sine, high friction.",
    )
    for (name, excitation), place in FIGURES.items():
        one = programme.results[name]
        is_sine = excitation == "sine"
        experiment = one.experiments.sine if is_sine else one.experiments.isa
        figures[place.lower().replace("fig. ", "figure_")] = (
            validation_figure(one, experiment, dict(one.sine if is_sine else one.isa)),
            f"{place}: validation, {name} friction, {excitation}; errors against the stem "
            "without sensor noise.",
        )
    figures |= {
        "validation_graphite_sine": (
            validation_figure(graphite, graphite.experiments.sine, dict(graphite.sine)),
            "As Figs. 6 and 7, graphite packing.",
        ),
        "validation_graphite_isa": (
            validation_figure(graphite, graphite.experiments.isa, dict(graphite.isa)),
            "As Figs. 8 and 9, graphite packing.",
        ),
    }
    return MappingProxyType(
        {name: Picture(figure, text, text) for name, (figure, text) in figures.items()}
    )
