"""The page of a session: the live picture, what is covered, the next pose, the verdict so far; all by viser."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import HecbenchError
from hecbench.running.isolation import Ended, Worker
from hecbench.verdict import Verdict
from hecbench_hardware.cockpit import judging, texts
from hecbench_hardware.cockpit.pointing_tab import PointingTab
from hecbench_hardware.cockpit.scene import Scene
from hecbench_hardware.cockpit.seeing import marked, small
from hecbench_hardware.cockpit.session import FEWEST, Now, Session
from hecbench_hardware.cockpit.suggestion import Suggestion
from hecbench_hardware.robots.typed import CONVENTIONS, TypedRobot

_CORNER_OF_WIDTH, _CONTOUR_OF_WIDTH = 300, 1000
_log = logging.getLogger(__name__)

Finish = Callable[[Session], Verdict]
Work = Callable[[], str | None]
"""Something to do, and what to say when it has ended."""


class Page:
    """Widgets and what they do.

    What a button asks for is done by `tick`, so that one thread alone talks to the camera; slow work is done one piece
    after the other beside it.
    """

    def __init__(self, server: Any, session: Session, tolerance_mm: float, finish: Finish) -> None:
        """`finish` calibrates what was recorded."""
        self.session, self._tolerance_mm, self._finish = session, tolerance_mm, finish
        self._now: Now | None = None
        self._wanted: Suggestion | None = None
        self._judged = 0
        self._asked: SimpleQueue[Work] = SimpleQueue()
        self._work, self._judging = ThreadPoolExecutor(1), ThreadPoolExecutor(1)
        self._judge_apart = Worker()
        self._scene = Scene(server, session.cell)
        server.gui.configure_theme(control_width="large")
        tabs = server.gui.add_tab_group()
        with tabs.add_tab("record"):
            self._add_recording(server.gui)
        with tabs.add_tab("verdict"):
            self._verdict = server.gui.add_markdown(texts.verdict(None, len(session)))
        with tabs.add_tab("point"):
            self._pointing = PointingTab(server, session, self._scene, self._asked.put, self._beside)
        self._after_change()

    def _add_recording(self, gui: Any) -> None:
        self._picture = gui.add_image(np.full((480, 640, 3), 200, np.uint8), label="live")
        self._seen = gui.add_markdown("")
        if isinstance(self.session.robot, TypedRobot):
            self._add_typing(gui, self.session.robot)
        take, undo = gui.add_button("take a sample"), gui.add_button("take the last one back", color="gray")
        self._automatic = gui.add_checkbox(
            "automatic", False, hint="take a sample whenever the robot stands still at another place"
        )
        self._next = gui.add_markdown("")
        drive, other = gui.add_button("drive there"), gui.add_button("another pose", color="gray")
        drive.visible = self.session.driven
        self._covered = gui.add_html("")
        self._said = gui.add_markdown("")
        finish = gui.add_button("finish: calibrate", color="green")
        take.on_click(lambda event: self._asked.put(self._take))
        undo.on_click(lambda event: self._asked.put(self._undo))
        drive.on_click(lambda event: self._beside(self._drive))
        other.on_click(lambda event: self._beside(self._suggest))
        finish.on_click(lambda event: self._beside(self._calibrate))

    def _add_typing(self, gui: Any, robot: TypedRobot) -> None:
        text = gui.add_text(
            "flange pose", "", hint="x y z and the rotation, or a 4x4 matrix, from the pendant"
        )
        convention = gui.add_dropdown("written as", CONVENTIONS)
        unit = gui.add_dropdown("lengths in", ("m", "mm"))
        degrees = gui.add_checkbox("angles in degrees", False)

        def use() -> str:
            robot.type(text.value, convention.value, unit.value, degrees.value)
            return "this pose is used for the next sample"

        gui.add_button("use this pose").on_click(lambda event: self._asked.put(use))

    def tick(self) -> None:
        """Show what camera and robot say now; take a sample when the automatic is on and it is time."""
        while not self._asked.empty():
            self._say(self._asked.get())
        try:
            self._show(self.session.look())
        except HecbenchError as error:
            self._seen.content = texts.fault(error)

    def _show(self, now: Now) -> None:
        self._now = now
        self._picture.image = small(self._marked(now))
        self._seen.content = texts.now(now, self.session.cell.target is not None)
        if now.state is not None:
            self._scene.show_robot(now.state.joints_rad, now.state.base_T_flange)
        if self._wanted is not None:
            self._next.content = texts.next_pose(self.session.words(self._wanted, now))
        self._pointing.show(now)
        if self._automatic.value and self.session.worth_taking(now):
            self._say(self._take)

    def _marked(self, now: Now) -> NDArray[np.uint8]:
        """The picture with the target's corners, or with the robot's contour where there is no target."""
        if now.seen is not None:
            return marked(now.image, now.seen.corners_px, _CORNER_OF_WIDTH)
        contour = self.session.outline(now)
        return now.image if contour is None else marked(now.image, contour, _CONTOUR_OF_WIDTH)

    def _say(self, work: Work) -> None:
        """Do something and say how it ended, where it has something to say."""
        try:
            said = work()
            if said is not None:
                self._said.content = said
        except (HecbenchError, Ended) as error:
            self._said.content = texts.fault(error)

    def _beside(self, work: Work, executor: ThreadPoolExecutor | None = None) -> None:
        """Do something slow beside the live picture, and say how it ended."""
        (executor or self._work).submit(self._say, work).add_done_callback(_logged)

    def _take(self) -> str:
        said = self.session.take()
        self._after_change()
        return said

    def _undo(self) -> str:
        said = self.session.undo()
        self._judged = 0
        self._after_change()
        return said

    def _after_change(self) -> None:
        self._covered.content = texts.coverage(self.session.coverage())
        self._scene.show_samples(self.session.flange_poses())
        self._beside(self._suggest)
        self._beside(self._judge_so_far, self._judging)

    def _suggest(self) -> None:
        wanted = self._wanted = self.session.suggest()
        if wanted is None:
            self._next.content = texts.next_pose(None)
            self._scene.show_ghost(None, None)
        else:
            flange = None if wanted.joints_rad is None else self.session.robot.arm.forward(wanted.joints_rad)
            self._next.content = texts.next_pose(self.session.words(wanted, self._now))
            self._scene.show_ghost(wanted.joints_rad, flange)

    def _drive(self) -> str:
        if self._wanted is None or self._wanted.joints_rad is None:
            return "there is no pose to drive to"
        self.session.robot.move_joints(self._wanted.joints_rad)
        return "arrived"

    def _judge_so_far(self) -> None:
        if (count := len(self.session)) != self._judged and count >= FEWEST:
            self.session.recording()
            found = self._judge_apart.call(judging.judge, self.session.folder, self._tolerance_mm)
            if count == len(self.session):
                self._judged = count
                self._show_verdict(found)

    def _calibrate(self) -> str:
        self._said.content = "calibrating with every method; this takes a while"
        found = self._finish(self.session)
        self._show_verdict(found)
        return f"calibrated: **{found.grade.words}**; see the tab verdict"

    def _show_verdict(self, found: Verdict | None) -> None:
        self.session.verdict = found
        self._verdict.content = texts.verdict(found, len(self.session))

    def close(self) -> None:
        """Wait for the work at hand; what is queued is dropped."""
        self._judge_apart.kill()
        for executor in (self._work, self._judging):
            executor.shutdown(cancel_futures=True)


def _logged(done: Future[None]) -> None:
    """A fault of the program itself is not lost in its thread."""
    if not done.cancelled() and (error := done.exception()) is not None:
        _log.error("the cockpit failed", exc_info=error)
