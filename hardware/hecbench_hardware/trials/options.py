"""What ``hecbench trial`` was asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hecbench.errors import InputError

_LEAST_PX = 64


@dataclass(frozen=True, kw_only=True)
class TrialOptions:
    """One field for each option of the command line, by its name there."""

    estimates: tuple[Path, ...]
    solvers: tuple[str, ...]
    offset_mm: float | None
    robot: str
    station: str
    urdf: str | None
    host: str | None
    arm: bool
    calibration: int | None
    camera: str | None
    gripper: str | None
    settings: tuple[str, ...]
    places: int
    trials: int | None
    clearance_mm: float
    size: str
    supersample: int
    noise: float
    render: bool
    dynamics: bool
    out: Path
    resume: bool
    yes: bool
    seed: int
    as_json: bool

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        if (self.offset_mm is None) == (not self.estimates):
            raise InputError("give either --estimate FILE or --offset-mm D")

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the lab's pictures."""
        width, cross, height = self.size.partition("x")
        numbers = cross and width.isdigit() and height.isdigit()
        if not (numbers and int(width) >= _LEAST_PX and int(height) >= _LEAST_PX):
            raise InputError(
                f"--size {self.size}: write WIDTHxHEIGHT in px, at least {_LEAST_PX}x{_LEAST_PX}"
            )
        return int(width), int(height)

    @property
    def host_option(self) -> dict[str, str]:
        """For a device that is opened at an address."""
        return {} if self.host is None else {"host": self.host}

    @property
    def provenance(self) -> dict[str, object]:
        """What a record should remember of them."""
        shown = ("robot", "station", "size", "supersample", "noise", "render", "dynamics")
        return {name: getattr(self, name) for name in shown}
