"""A link that breaks under a request is a named fault, whatever words the client library has for it."""

import time

import pytest
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.ur import worker
from hecbench_hardware.ur.outputs import Outputs

from hecbench.errors import HecbenchError

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")


class Client:
    """Raises what it is asked for."""

    def call(self, error):
        raise error


@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (RuntimeError("End of file"), worker.BROKEN),
        (BrokenPipeError("Broken pipe"), worker.BROKEN),
        (TypeError("incompatible function arguments"), worker.REFUSED),
        (AttributeError("moveJ is not one of"), worker.REFUSED),
        (ValueError("out of range"), worker.REFUSED),
    ],
)
def test_a_broken_link_and_a_wrong_call_are_told_apart(error, outcome):
    assert worker._answer(Client(), "call", (error,), 1.0) == (outcome, str(error))


def until_fault(call):
    def again_and_again():
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            call()

    with pytest.raises(DeviceFault) as caught:
        again_and_again()
    assert "\n" not in str(caught.value)
    return caught.value.fault


def test_outputs_whose_link_breaks(controller):
    with Outputs(controller.host) as outputs:
        outputs.call("setStandardDigitalOut", 0, True)
        with pytest.raises(HecbenchError, match="incompatible function arguments"):
            outputs.call("setStandardDigitalOut", "nought")
        outputs.call("setStandardDigitalOut", 0, False)
        controller.fault("link_loss 0.5")
        assert until_fault(lambda: outputs.call("setStandardDigitalOut", 0, True)) is Fault.LINK_LOST
        with pytest.raises(DeviceFault, match="the link is gone"):
            outputs.call("setStandardDigitalOut", 0, True)


def test_control_whose_link_breaks(robot, controller):
    controller.fault("link_loss 0.5")
    assert until_fault(lambda: robot._control.request("call", "getTCPOffset")) is Fault.LINK_LOST
    assert not robot._control.worker.alive
