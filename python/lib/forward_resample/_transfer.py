"""Transfer functions: colour maps of Matplotlib, opacities as PyVista has them, ParaView's JSON."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Optional, Union

import numpy as np

from . import _native
from ._scene import as_json

#: Steps of a colour map that is sampled: one for each code of 8 bits.
_STEPS = 256

Opacity = Union[str, Sequence[float], "np.ndarray[Any, Any]"]


class TransferFunction(dict):  # type: ignore[type-arg]
    """A transfer function as ParaView's JSON has it, with colours in sRGB; made by :func:`transfer_function`."""

    #: Whether it has a range of its own; else it spans the values of the volume.
    has_range: bool = True

    def options(self) -> dict[str, Any]:
        """The options that draw with it."""
        options = {"transfer": as_json(self), "transfer_space": "srgb"}
        return options if self.has_range else {**options, "rescale_transfer": True}


def transfer_function(cmap: Any = "viridis", opacity: Opacity = "linear", clim: Optional[tuple[float, float]] = None) -> TransferFunction:
    """A transfer function of a colour map and an opacity.

    Args:
        cmap: the name of a colour map of Matplotlib, such a map, or colours (n, 3), sRGB from 0 to 1.
        opacity: ``"linear"``, ``"linear_r"``, ``"geom"``, ``"geom_r"``, ``"sigmoid"``, ``"sigmoid_3"`` to ``"sigmoid_20"`` as PyVista
            has them; or numbers from 0 to 1 (or to 255), evenly spaced over the range. Opacities are per voxel, unless
            ``opacity_unit=`` says otherwise.
        clim: the values that the map spans; without it those of the volume.

    >>> function = transfer_function([[0, 0, 0], [1, 1, 1]], [0, 0.5], clim=(10, 20))
    >>> function["Points"]
    [10.0, 0.0, 0.5, 0.0, 20.0, 0.5, 0.5, 0.0]
    """
    colours, alphas = _colours(cmap), _opacities(opacity)
    low, high = (0.0, 1.0) if clim is None else (float(clim[0]), float(clim[1]))
    if not low < high:
        raise ValueError(f"clim: expected two numbers, the first below the second, got {clim}")
    points: list[float] = []
    for value, alpha in zip(np.linspace(low, high, len(alphas)), alphas):
        points += [float(value), float(alpha), 0.5, 0.0]
    knots: list[float] = []
    for value, (red, green, blue) in zip(np.linspace(low, high, len(colours)), colours):
        knots += [float(value), float(red), float(green), float(blue)]
    function = TransferFunction(ColorSpace="RGB", RGBPoints=knots, Points=points)
    function.has_range = clim is not None
    return function


def _colours(cmap: Any) -> Any:
    if isinstance(cmap, str):
        try:
            import matplotlib
        except ImportError as error:
            raise ImportError(f"cmap: '{cmap}' is a colour map of Matplotlib, which is not installed") from error
        try:
            cmap = matplotlib.colormaps[cmap]
        except KeyError:
            raise ValueError(f"cmap: neither a preset, a colour map of resample, nor one of Matplotlib: '{cmap}'") from None
    if callable(cmap):
        return np.asarray(cmap(np.linspace(0.0, 1.0, _STEPS)))[:, :3]
    colours = np.asarray(cmap, dtype=float)
    if colours.ndim != 2 or colours.shape[0] < 2 or colours.shape[1] not in (3, 4):
        raise ValueError(f"cmap: expected a name, a colour map, or colours of the shape (n, 3), got the shape {colours.shape}")
    return colours[:, :3]


def _opacities(opacity: Opacity) -> Any:
    if not isinstance(opacity, str):
        alphas = np.asarray(opacity, dtype=float)
        if alphas.ndim != 1 or len(alphas) < 2:
            raise ValueError(f"opacity: expected a name or at least two numbers, got the shape {alphas.shape}")
        if alphas.max() > 1.0:
            alphas = alphas / 255.0
        if not (alphas.min() >= 0.0 and alphas.max() <= 1.0):
            raise ValueError("opacity: expected numbers from 0 to 1, or from 0 to 255")
        return alphas
    name, _, reverse = opacity.partition("_r")
    kind, _, width = name.partition("_")
    steps = np.linspace(0.0, 1.0, _STEPS)
    if kind == "linear" and not width:
        alphas = np.array([0.0, 1.0])
    elif kind == "geom" and not width:
        alphas = np.geomspace(1e-6, 255.0, _STEPS) / 255.0
    elif kind == "sigmoid" and (not width or width.isdigit()):
        half = float(width or 10)
        alphas = 1.0 / (1.0 + np.exp(-(2.0 * steps - 1.0) * half))
    else:
        raise ValueError(f"opacity: expected linear, geom, sigmoid or sigmoid_N, each perhaps with _r behind it, got '{opacity}'")
    return alphas[::-1] if opacity.endswith("_r") else alphas


def transfer_options(transfer: Any) -> dict[str, Any]:
    """The options of whatever stands for a transfer function."""
    if transfer is None:
        return {}
    if isinstance(transfer, TransferFunction):
        return transfer.options()
    if isinstance(transfer, os.PathLike) or (isinstance(transfer, str) and transfer.lower().endswith(".json")):
        return {"transfer": os.fspath(transfer)}
    if isinstance(transfer, str):
        for option in ("preset", "colormap"):
            if is_known(option, transfer):
                return {option: transfer}
        return transfer_function(transfer).options()
    if isinstance(transfer, dict) or (isinstance(transfer, list) and all(isinstance(map, dict) for map in transfer)):
        return {"transfer": as_json(transfer)}
    if isinstance(transfer, tuple) and 2 <= len(transfer) <= 3:
        return transfer_function(*transfer).options()
    return transfer_function(transfer).options()


def is_known(option: str, word: Any) -> bool:
    """Whether an option of ``resample volsplat`` has this value."""
    if not isinstance(word, str):
        return False
    try:
        _native.check("volsplat", ["array"], {option: word})
    except ValueError:
        return False
    return True
