# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Standard errors from the scatter between strokes, by leaving out each stroke in turn."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

_Member = TypeVar("_Member")


class Jackknife(NamedTuple):
    """Values of all members together, their standard errors, and the degrees of freedom.

    A standard error is nan where a group has a single member; the freedom is members less groups.
    """

    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    freedom: int


def jackknife(
    groups: Sequence[Sequence[_Member]],
    statistic: Callable[[Sequence[Sequence[_Member]]], Mapping[str, float]],
) -> Jackknife:
    """Evaluate `statistic`, and its standard error from the scatter within the groups.

    Leaving out each of the n members of a group in turn gives n values θ_i, and the group's share
    of the variance is (n − 1)/n·Σ(θ_i − mean θ)². For a mean this is s²/n. The effect of
    one member's error on several quantities is included.

    Parameters
    ----------
    groups : sequence of sequences
        Independent members of each kind, at least one a group.
    statistic : callable
        From groups to named values.

    Returns
    -------
    Jackknife
        Values, standard errors, degrees of freedom.

    References
    ----------
    B. Efron and C. Stein, Annals of Statistics 9 (1981) 586–596.
    """
    values = dict(statistic(groups))
    variances = dict.fromkeys(values, 0.0)
    for index, group in enumerate(groups):
        size = len(group)
        if size < 2:
            variances = dict.fromkeys(values, math.nan)
            break
        trials = [
            statistic([*groups[:index], [*group[:one], *group[one + 1 :]], *groups[index + 1 :]])
            for one in range(size)
        ]
        for name in values:
            mean = sum(trial[name] for trial in trials) / size
            scatter = sum((trial[name] - mean) ** 2 for trial in trials)
            variances[name] += (size - 1) / size * scatter
    errors = {name: math.sqrt(variance) for name, variance in variances.items()}
    return Jackknife(values, errors, sum(map(len, groups)) - len(groups))
