"""The option of every plugin that a network serves."""

from hecbench.specs import Option

MODEL_OPTION = Option(
    "model", str, "a perception plugin or the folder of a trained network; default: one that fits"
)
