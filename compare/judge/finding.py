"""What is found, as numbers: the words stand in templates."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Finding:
    """A sentence to be written: the macro `kind` of the template `of`.md.jinja, called with `values`."""

    of: str  # an experiment, or another template
    kind: str
    values: Mapping[str, object] = field(default_factory=dict)
