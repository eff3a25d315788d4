"""The functions of URScript that the simulated controller executes, by name."""

from __future__ import annotations

from typing import Final

from hecbench_hardware.controller_sim.urscript.functions import Builtin
from hecbench_hardware.controller_sim.urscript.library import (
    gripper,
    maths,
    motion,
    poses,
    settings,
    sockets,
    state,
    terminals,
    texts,
)

LIBRARY: Final[dict[str, Builtin]] = {
    **maths.FUNCTIONS,
    **poses.FUNCTIONS,
    **texts.FUNCTIONS,
    **motion.FUNCTIONS,
    **state.FUNCTIONS,
    **settings.FUNCTIONS,
    **terminals.FUNCTIONS,
    **sockets.FUNCTIONS,
    **gripper.FUNCTIONS,
}
