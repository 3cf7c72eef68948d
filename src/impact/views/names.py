"""The kinds of picture and their widths by name; apart, so that the command line knows them without matplotlib."""

from __future__ import annotations

KINDS = {
    "final-velocities": "velocities after the impact beside the impulse-momentum solution, Figure 6 of the paper",
    "restitution": "restitution delivered over what was asked for",
    "error": "error of the restitution, signed and absolute",
    "map": "a variable over two axes, a panel for each model",
    "validity": "over two axes, which model is closest to what was asked for, and how close",
    "loop": "force over indentation",
    "history": "indentation, its rate and the force over time",
    "impulse": "velocities over the impulse that has passed",
}
# those that follow a point through time, which --sel chooses
FOLLOWED = ("loop", "history", "impulse")
# of one column of a journal, and of two [in]
WIDTHS = {"single": 3.5, "double": 7.1}
LOGS = ("x", "y", "xy")
