"""Arrays of other packages as NumPy's, without a copy where that is possible."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def as_array(value: Any, name: str) -> npt.NDArray[Any]:
    """Any array as NumPy's. Errors name the argument.

    >>> as_array([[1, 2], [3, 4]], "depth").shape
    (2, 2)
    """
    device = getattr(value, "device", None)
    if hasattr(value, "detach"):
        value = value.detach()
        if getattr(device, "type", "cpu") != "cpu":
            raise ValueError(f"{name}: is on the device '{device}': call .cpu() first")
    if not isinstance(value, np.ndarray) and not hasattr(value, "__array__") and hasattr(value, "__dlpack__"):
        value = np.from_dlpack(value)
    array = np.asarray(value)
    if array.dtype.kind == "O":
        raise TypeError(f"{name}: expected an array of numbers, got {type(value).__name__}")
    return array


def scalars(array: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    """Whole or real numbers in this machine's byte order, in either memory order, without gaps."""
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "b":
        array = array.view(np.uint8)
    elif kind == "f" and size == 2:
        array = array.astype(np.float32)
    elif kind == "f" and size > 8:
        array = array.astype(np.float64)
    elif kind not in "uif":
        raise TypeError(f"{name}: expected whole or real numbers, got {array.dtype}")
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    if not (array.flags.c_contiguous or array.flags.f_contiguous):
        array = np.ascontiguousarray(array)
    return array


def table(value: Any, name: str, columns: int, dtype: Any) -> npt.NDArray[Any]:
    """Rows of so many numbers.

    >>> table([[0, 0, 0]], "vertices", 3, float).shape
    (1, 3)
    >>> table([[0, 0]], "vertices", 3, float)
    Traceback (most recent call last):
    ValueError: vertices: expected the shape (n, 3), got (1, 2)
    """
    array = as_array(value, name)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name}: expected the shape (n, {columns}), got {array.shape}")
    return np.ascontiguousarray(array, dtype=dtype)
