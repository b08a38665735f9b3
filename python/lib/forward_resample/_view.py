"""The live viewer, inside a notebook or beside it."""

from __future__ import annotations

import html
from typing import Any, Optional

from . import _native
from ._scene import Scene
from ._volume import Volume


class Viewer:
    """A page that shows a scene live: turn, zoom, edit the transfer function. A notebook shows it as a frame.

    Attributes:
        address: where the page is on this machine, with the token that opens it.
    """

    def __init__(self, served: _native.Viewer, through: Optional[str], height: int):
        self._served, self._height = served, height
        self.address = served.address
        _, _, rest = self.address.partition("://")
        host, _, path = rest.partition("/")
        port = host.rpartition(":")[2]
        #: Where a browser finds it.
        self.source = self.address if through is None else through.rstrip("/").format(port=port) + "/" + path

    def close(self) -> None:
        """Ends the drawing; the page stays as it is."""
        self._served.close()

    def __repr__(self) -> str:
        return f"Viewer at {self.source}"

    def _repr_html_(self) -> str:
        source = html.escape(self.source, quote=True)
        return f'<iframe src="{source}" width="100%" height="{self._height}" style="border: 0"></iframe>'


def view(
    scene: Any,
    *,
    through: Optional[str] = None,
    port: Optional[int] = None,
    allow_host: Optional[str] = None,
    height: int = 640,
    **options: Any,
) -> Viewer:
    """Shows a scene live, as ``resample view`` does; threads of this process draw it.

    Args:
        scene: a :class:`Volume`, :class:`Gaussians`, :class:`Mesh`, :class:`DepthImage` or :class:`Points`, or whatever a :class:`Volume` is made of.
        through: how a browser reaches a port of this machine, where that is another one: ``"/proxy/{port}"`` with
            jupyter-server-proxy (``"/user/NAME/proxy/{port}"`` on a JupyterHub).
        port: of the page; 7467 if not given, or any that is free.
        allow_host: the name under which such a proxy is reached.
        height: of the frame in a notebook, px.
        options: any option of the scene's command.

    Returns:
        The page; the last line of a cell shows it. It is served until ``close()``, or until nothing holds it any more.

    >>> import numpy as np
    >>> page = view(np.arange(4096, dtype=np.uint16).reshape(16, 16, 16), through="/proxy/{port}", port=0)
    >>> page.source.startswith("/proxy/") and page.address.startswith("http://127.0.0.1:")
    True
    >>> page.close()
    """
    shown = scene if isinstance(scene, Scene) else Volume(scene)
    words = ["--no-open"]
    if port is not None:
        words.append(f"--port={port}")
    if allow_host is not None:
        words.append(f"--allow-host={allow_host}")
    return Viewer(shown._native.view(shown._all(options), words), through, height)
