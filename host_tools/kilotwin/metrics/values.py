"""Values of metrics at samples."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class MetricValues:
    """Values at k samples of N robots; NaN where there is none.

    `of_robots`: of variables that are kept of each robot, [k, N].
    """

    values: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    of_robots: dict[str, NDArray[np.float64]] = field(default_factory=dict)


NO_METRICS = MetricValues()
"""Nothing was measured."""
