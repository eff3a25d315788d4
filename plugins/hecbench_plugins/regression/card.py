"""What a regression model's folder says about its weights."""

from __future__ import annotations

from hecbench_plugins.perception.card import NetworkCard
from hecbench_plugins.perception.card_text import Words
from hecbench_plugins.perception.skeleton import Keypoint

WEIGHTS = "regression.onnx"


class RegressionCard(NetworkCard, frozen=True, kw_only=True):
    """About a network that answers poses.

    Attributes:
        joints: of the robot, in the order in which the network takes them; the first turns the whole arm.
        reference: the link whose pose is answered.
        keypoints: of the robot, whose mean is its middle.
        size: px of the square picture that the network takes.
    """

    joints: tuple[str, ...]
    reference: str
    keypoints: tuple[Keypoint, ...]
    size: int

    verb = "regression"

    def fault(self) -> str | None:
        """What the card lacks."""
        complete = len(self.robots) == 1 and len(self.joints) > 1 and self.keypoints and self.size > 0
        return None if complete else "needs one robot, its joints and its keypoints"


WORDS = Words(
    "Answers the pose of a standing camera from one picture and the robot's joints (after Valassakis et al. 2021)."
    " Used by the solver `regression`.",
    (
        "It was trained on drawn pictures of the arm alone. What it says is a rough place, not a calibration.",
        "A camera on the flange, which does not see the whole arm, was not trained.",
        "All views of one camera are wrong in similar ways, so that more of them help little.",
        "Crowded pictures without a robot are often answered; only the spread of the views says so.",
    ),
)
