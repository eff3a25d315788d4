"""What the grippers have in common: fingers that stand still until the arm may move."""

from __future__ import annotations

from hecbench.errors import InputError


class Guarded:
    """Refuses commands before `enable`."""

    name: str
    enabled: bool = False

    def enable(self) -> None:
        """The fingers may move from now on."""
        self.enabled = True

    def refuse_disabled(self) -> None:
        """Raise an `InputError` before `enable`."""
        if not self.enabled:
            raise InputError(f"{self.name} is read-only: take control of the arm first (--arm)")
