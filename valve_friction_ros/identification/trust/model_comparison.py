# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Comparison of two models of one record: which is more probable."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.wording import evidence_ratio_words


class Support(Enum):
    """How strongly a record favours one of two models, after Kass and Raftery (1995)."""

    HARDLY = 1.0
    POSITIVE = 3.0
    STRONG = 20.0
    VERY_STRONG = 150.0

    @classmethod
    def of(cls, log_ratio: float) -> "Support":
        """Return the strongest support whose ratio, its value, is reached in either direction."""
        return max(
            (one for one in cls if abs(log_ratio) >= math.log(one.value)), key=lambda one: one.value
        )


@dataclass(frozen=True)
class ModelComparison:
    """Two models of one record.

    Attributes
    ----------
    log_ratio : float
        Natural logarithm of the evidence for the first over that for the second.
    rms : tuple of float
        Root mean square residual of the stem under each model, m.
    free : tuple of int
        Free parameters of each.
    samples, independent : float
        Samples of the stem, and the equivalent number of independent samples.
    describes : tuple of bool
        Whether the residual of each model is no more than noise.

    Notes
    -----
    The evidence is Schwarz's: −n/2·ln(mean square) − p/2·ln n, with n independent samples and p
    free parameters. The residual of a model is autocorrelated, so n is the number of samples over
    the sum of its autocorrelation at all lags, for the model with the smaller n. That is rough: the
    two stems differ in few places, and the ratio of two wrong models says which is nearer, not
    which is true.
    """

    log_ratio: float
    rms: tuple[float, float]
    free: tuple[int, int]
    samples: float
    independent: float
    describes: tuple[bool, bool] = (True, True)

    @property
    def support(self) -> Support:
        """How strongly the record favours one of the models."""
        return Support.of(self.log_ratio)

    def __str__(self) -> str:
        """Return the comparison in words."""
        return evidence_ratio_words(
            self.support.name, self.log_ratio, self.samples, self.independent, self.describes
        )


def independent_samples(residual: NDArray[np.float64]) -> float:
    """Return the number of independent samples that an autocorrelated residual is worth.

    The autocorrelation is summed up to the lag at which a pair of neighbours is negative (Geyer's
    initial positive sequence).
    """
    centred = residual - np.mean(residual)
    size = centred.size
    spectrum = np.abs(np.fft.rfft(centred, 2 * size)) ** 2
    products = np.fft.irfft(spectrum, 2 * size)[:size]
    if not products[0] > 0:
        return float(size)
    shares = products / products[0]
    pairs = shares[: size // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs < 0)
    pairs = pairs[: negative[0]] if negative.size else pairs
    return float(np.clip(size / max(2.0 * float(np.sum(pairs)) - 1.0, 1.0), 1.0, size))


def models_compared(
    residuals: tuple[NDArray[np.float64], NDArray[np.float64]],
    free: tuple[int, int],
    describes: tuple[bool, bool] = (True, True),
) -> ModelComparison:
    """Compare two models by their residuals on the same samples of the stem.

    Parameters
    ----------
    residuals : tuple of ndarray of float, shape (n,)
        Simulated minus measured position of each, m.
    free : tuple of int
        Free parameters of each.
    describes : tuple of bool
        Whether each residual is no more than noise.

    Examples
    --------
    Half the deviation in 100 independent samples, for one parameter more, is a ratio of
    2^100 / 10.

    >>> import numpy as np
    >>> one = np.random.default_rng(0).permutation(np.repeat([-1.0, 1.0], 50))
    >>> found = models_compared((one, 2 * one), (5, 4))
    >>> round(found.independent), found.support.name
    (100, 'VERY_STRONG')
    >>> abs(found.log_ratio - (100 * np.log(2) - 0.5 * np.log(100))) < 1e-9
    True
    """
    samples = float(residuals[0].size)
    independent = min(map(independent_samples, residuals))
    squares = [float(np.mean(one**2)) for one in residuals]
    least = np.finfo(float).tiny
    fits = [-0.5 * independent * math.log(max(one, least)) for one in squares]
    costs = [0.5 * count * math.log(independent) for count in free]
    log_ratio = (fits[0] - costs[0]) - (fits[1] - costs[1])
    rms = math.sqrt(squares[0]), math.sqrt(squares[1])
    return ModelComparison(log_ratio, rms, free, samples, independent, describes)
