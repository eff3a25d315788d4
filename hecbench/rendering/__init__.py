"""The CPU rasteriser and its pose derivative; nothing else of the project knows how a triangle is filled."""

from hecbench.rendering.crossings import Crossings
from hecbench.rendering.mesh import RenderMesh
from hecbench.rendering.renderer import Renderer

__all__ = ["Crossings", "RenderMesh", "Renderer"]
