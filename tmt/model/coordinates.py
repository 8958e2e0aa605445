"""The names of tmt.derivation.coordinates, where other modules still look for them."""

from tmt.derivation.coordinates import FLAT as FLAT
from tmt.derivation.coordinates import KINDS as KINDS
from tmt.derivation.coordinates import Coordinates as Coordinates
from tmt.derivation.coordinates import Flat as Flat
from tmt.derivation.coordinates import coordinates_of as coordinates_of
from tmt.derivation.coordinates import normalized as normalized
from tmt.derivation.coordinates import product as product
