"""Writes the typed options of the package from those of the command line: ``python typed_options.py FILE``."""

import sys

from forward_resample import _native, options

#: The commands, their classes in Python, and options that their functions take as arguments of their own.
CLASSES = {
    "volsplat": ("Volume", {"spacing", "origin", "mask", "also", "transfer", "camera", "size"}),
    "gaussians": ("Gaussians", {"camera", "size", "blend"}),
    "texmap": ("Mesh", {"camera", "size", "texture"}),
    "warp3d": ("Depth", {"camera", "size", "pixel_centre"}),
    "points": ("Points", {"camera", "size"}),
}

HEAD = '''"""The options of each command with their types, as checkers and editors see them. Made by ``python/tests/typed_options.py``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Literal, TypedDict, Union

#: A word of the command line: text, a number, the name of a file, or what goes into JSON.
Value = Union[str, int, float, "os.PathLike[str]", dict[str, Any], list[Any], tuple[Any, ...]]

#: Numbers with commas between them.
Numbers = Union[str, float, Sequence[float]]

#: Width and height, or columns and rows.
Size = Union[str, tuple[int, int], Sequence[int]]
'''


def typed(kind: str, choices: list[str]) -> str:
    """The type of an option."""
    words = f"Literal[{', '.join(map(repr, choices))}]".replace("'", '"') if choices else "Value"
    return {
        "flag": "bool",
        "value": words,
        "optional": f"Union[bool, {words}]",
        "list": "Numbers",
        "size": "Size",
        "several": "Any",
    }[kind]


def text() -> str:
    """The module."""
    parts = [HEAD]
    for command, (name, own) in CLASSES.items():
        help_ = options(command)
        lines = [f"\n\nclass {name}Options(TypedDict, total=False):", f'    """The options of ``resample {command}``."""\n']
        for option, kind, choices in _native.kinds(command):
            # `from` is a word of Python: `from_` stands for it.
            spelled = option + "_" if option == "from" else option
            if option not in own:
                lines += [f"    #: {help_.get(option, '')}".rstrip(), f"    {spelled}: {typed(kind, choices)}"]
        picture = {"size": "Size"} | ({"transfer": "Any"} if "transfer" in own else {})
        further = {
            "Call": ("Options", "The options of a scene, with the view.", {"camera": "Any", "size": "Size"}),
            "Render": ("Options", "The options of a picture.", picture),
            "Pictures": ("Render", "The options of several pictures, with the camera.", {"camera": "Any"}),
        }
        for kind, (base, about, more) in further.items():
            lines += [f"\n\nclass {name}{kind}({name}{base}, total=False):", f'    """{about}"""']
            lines += [""] + [f"    {option}: {kind_}" for option, kind_ in more.items()]
        parts.append("\n".join(lines) + "\n")
    return "".join(parts)


if __name__ == "__main__":
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write(text())
