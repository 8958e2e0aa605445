"""Any number type over which the method is written."""

from typing import Any

Scalar = Any
Values = list[Scalar]
Rows = list[Values]
