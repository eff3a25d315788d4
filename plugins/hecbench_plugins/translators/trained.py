"""The paper's translators: adversarial networks that turn a cut out robot into a drawn one, from their folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from hecbench.errors import InputError
from hecbench.registry import hookimpl
from hecbench.specs import Option, Translator, TranslatorSpec
from hecbench_plugins.translation.plan import Method

_SUMMARIES = {
    Method.CYCLEGAN: "Zhu et al. 2017, cycle consistency",
    Method.CUT: "Park et al. 2020, contrast of patches",
    Method.GEOMASKGAN: "Lu et al. 2022, CycleGAN whose masks are kept by a network that learns them",
    Method.CYCLEGAN_MASK: "DRHeC's, CycleGAN with a mask loss",
}


def load(method: str, model: str | None = None) -> Translator:
    """The trained translator of a method.

    Raises:
        InputError: no folder is given, or it holds none of this method.
    """
    if model is None:
        raise InputError(
            f"translator '{method}': train one by 'hecbench train translation --method {method}' and give its folder,"
            f" {method}[model=FOLDER]"
        )
    from hecbench_plugins.translation.model import TrainedTranslator

    return TrainedTranslator(Path(model), method)


@hookimpl
def hecbench_translators() -> Iterable[TranslatorSpec]:
    """One for each method."""
    for method, summary in _SUMMARIES.items():
        factory: Callable[..., Translator] = partial(load, method)
        yield TranslatorSpec(
            name=method,
            summary=summary,
            factory=factory,
            options=(Option("model", str, "folder of the trained translator"),),
        )
