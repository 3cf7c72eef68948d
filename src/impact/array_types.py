"""Types of NumPy arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]
# statuses, modes and regimes
Int8Array = NDArray[np.int8]
AnyArray = NDArray[Any]
