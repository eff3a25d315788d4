"""Whether a controller is ready to be moved, why not, and how it is made ready after a stop."""

from __future__ import annotations

import time
from collections.abc import Callable

from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.ur.dashboard import Dashboard, probe
from hecbench_hardware.ur.stream import Sample, fault_of

_LINK_S = 10.0
_UNLOCK_S = 10.0
"""Longer than the five seconds during which the controller refuses to unlock a protective stop."""
_RELEASE_S = 5.0
_POWER_S = 30.0
_POLL_S = 0.05


def refuse_unready(device: str, dashboard: Dashboard, sample: Sample) -> None:
    """Raise a `DeviceFault` when taking control would fail or would disturb somebody."""
    if found := fault_of(sample):
        raise DeviceFault(found[0], device, found[1])
    if not dashboard.is_remote():
        raise DeviceFault(Fault.LOCAL_MODE, device, "the pendant is in local control")
    if sample.playing:
        raise DeviceFault(Fault.BUSY, device, "another program or client is running there")


def explained(device: str, words: str) -> DeviceFault:
    """The client library's refusal as a named fault."""
    if "in use" in words:
        return DeviceFault(Fault.BUSY, device, "another client controls it")
    if "remote" in words:
        return DeviceFault(Fault.LOCAL_MODE, device, "the pendant is in local control")
    return DeviceFault(Fault.LINK_LOST, device, words.splitlines()[0] if words else "the client refused")


def make_ready(device: str, dashboard: Dashboard) -> None:
    """Bring the controller back: wait for the link, unlock, power on, release the brakes, as far as needed.

    Raises:
        DeviceFault: A step did not succeed in time; the operator must act.
    """

    def lost() -> DeviceFault:
        return DeviceFault(Fault.LINK_LOST, device, f"not reachable for {_LINK_S:.0f} s")

    _until(lambda: _answers(dashboard), _LINK_S, lost)
    safety = dashboard.ask("safetymode").upper()
    if "PROTECTIVE" in safety:
        dashboard.ask("close safety popup")
        _until(
            lambda: dashboard.ask("unlock protective stop") == "Protective stop releasing",
            _UNLOCK_S,
            lambda: DeviceFault(Fault.PROTECTIVE_STOP, device, "the controller refuses to unlock"),
        )
    elif "NORMAL" not in safety and "REDUCED" not in safety:
        _until(
            lambda: "EMERGENCY" not in dashboard.ask("safetymode").upper(),
            _RELEASE_S,
            lambda: DeviceFault(Fault.EMERGENCY_STOP, device, "the button is still pressed"),
        )
    if not _is_in(dashboard, "RUNNING"):
        failure = DeviceFault(Fault.POWER_OFF, device, "the arm does not power on")
        dashboard.ask("power on")
        _until(lambda: _is_in(dashboard, "IDLE"), _POWER_S, lambda: failure)
        dashboard.ask("brake release")
        _until(lambda: _is_in(dashboard, "RUNNING"), _POWER_S, lambda: failure)
    dashboard.ask("stop")


def _is_in(dashboard: Dashboard, robot_mode: str) -> bool:
    return dashboard.ask("robotmode").upper().endswith(robot_mode)


def _answers(dashboard: Dashboard) -> bool:
    try:
        probe(dashboard.host)
        dashboard.ask("robotmode")
    except DeviceFault:
        return False
    return True


def _until(done: Callable[[], bool], timeout_s: float, failure: Callable[[], DeviceFault]) -> None:
    deadline = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > deadline:
            raise failure()
        time.sleep(_POLL_S)
