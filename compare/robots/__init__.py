"""What is compared. All that is specific to the assignment's arm is in arm.py."""

from .case import Robot
from .printed import Claims, Feature, Printed, Question

__all__ = ["Claims", "Feature", "Printed", "Question", "Robot"]
