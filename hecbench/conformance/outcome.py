"""The outcome of a check, and how a check is run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

Subject = TypeVar("Subject")


@dataclass(frozen=True)
class Check:
    """A law by name, whether the plugin keeps it, and the first way in which it does not."""

    name: str
    passed: bool
    detail: str = ""


def run(checks: Mapping[str, Callable[[Subject], Iterator[str]]], subject: Subject) -> list[Check]:
    """Every check on one plugin; a check yields the faults that it finds, and a crash is a fault like any other."""
    return [Check(name, *_outcome(check, subject)) for name, check in checks.items()]


def _outcome(check: Callable[[Subject], Iterator[str]], subject: Subject) -> tuple[bool, str]:
    try:
        fault = next(iter(check(subject)), "")
    except Exception as error:  # whatever a stranger's plugin raises
        return False, f"crashed with {type(error).__name__}: {error}"
    return not fault, fault
