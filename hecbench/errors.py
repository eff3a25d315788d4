"""Errors whose one-line message names the file, the value and the cure; the command line prints it alone."""


class HecbenchError(Exception):
    """Something failed although it was asked for correctly. The command line exits with 1."""

    exit_code = 1

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


class InputError(HecbenchError):
    """Wrong usage or unreadable input. The command line exits with 2."""

    exit_code = 2


class TargetNotSeen(InputError):
    """No image shows the target that the recording describes."""


class InvalidAnswer(InputError):
    """What claims to be an estimate is none: a transform that is not rigid, a status without a reason."""


class Refusal(HecbenchError):
    """A solver cannot answer on this recording; the message is the reason, one sentence. Status `refused`."""


class SolverFailure(HecbenchError):
    """A solver ran and knows that its answer is wrong or missing; the message says why. Status `failed`."""
