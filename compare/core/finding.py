"""Findings: numbers and names for a macro of a template."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Finding:
    """The macro `kind` of the template `of`.md.jinja, to be called with `values`."""

    of: str  # an experiment, or another template
    kind: str
    values: Mapping[str, Any] = field(default_factory=dict)
