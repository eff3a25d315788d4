"""The process of `SimulatedController`, with arguments HOST MODEL TIME_SCALE VERSION."""

import os
import sys

from hecbench.errors import HecbenchError
from hecbench_hardware.controller_sim.server import serve, version_of


def main(host: str, model: str, time_scale: str, version: str) -> None:
    """Serve until told to stop; one line on stdout: ready, or what is wrong."""

    def announce(line: str) -> None:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()

    try:
        serve(
            host,
            model=model,
            time_scale=float(time_scale),
            version=version_of(version),
            announce=announce,
            lifeline=sys.stdin.buffer,
        )
    except HecbenchError as error:
        announce(str(error))
        sys.exit(error.exit_code)
    except BrokenPipeError:
        os._exit(1)  # nobody is left to serve or to tell; a normal exit would write to stdout once more


main(*sys.argv[1:])
