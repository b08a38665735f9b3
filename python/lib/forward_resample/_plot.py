"""Pictures in Matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._picture import Picture


def plot(picture: Picture, ax: Any = None, *, colour_bar: bool = True, label: str = "") -> Any:
    """Shows a picture in axes of Matplotlib as a PNG shows it, and its scale of colours beside it.

    Axes count pixels from the upper left corner, as :meth:`Picture.project` does, so that
    ``ax.plot(*picture.project(points)[:, :2].T)`` marks places of the world. (``imshow(picture)`` would take linear light for display
    colours.)

    Args:
        picture: what :meth:`Volume.render` and its kin give.
        ax: the axes; by default new ones without ticks.
        colour_bar: False leaves the bar out. Pictures without one scale of colours have none.
        label: what stands beside the bar.

    Returns:
        The axes.

    Raises:
        ImportError: there is no Matplotlib.
    """
    import matplotlib.pyplot as plt
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    if ax is None:
        _, ax = plt.subplots()
        ax.set_axis_off()
    height, width = picture.shape[:2]
    ax.imshow(picture.to_srgb8(), extent=(0, width, height, 0), interpolation="none")
    if colour_bar and picture.colours is not None:
        (low, high), colours = picture.colours
        scale = ScalarMappable(Normalize(low, high), ListedColormap(np.clip(colours, 0, 1)))
        ax.figure.colorbar(scale, ax=ax, label=label)
    return ax
