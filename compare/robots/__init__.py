"""What is compared. All that is specific to the assignment's arm is in arm.py."""

from .robot import Claims, Feature, Printed, Question, Robot

__all__ = ["Claims", "Feature", "Printed", "Question", "Robot"]
