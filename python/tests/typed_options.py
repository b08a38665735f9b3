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

#: Two numbers, or pairs of numbers.
Curve = Union[str, Sequence[float], Sequence[Sequence[float]]]

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
        "curve": "Curve",
        "list": "Numbers",
        "size": "Size",
        "several": "Any",
    }[kind]


def described_options(command: str, own: set[str]) -> dict[str, str]:
    """The lines of each option but those that functions take as arguments of their own."""
    help_ = options(command)
    lines = {}
    for option, kind, choices in _native.kinds(command):
        if option not in own:
            # `from` is a word of Python: `from_` stands for it.
            spelled = option + "_" if option == "from" else option
            lines[option] = f"    #: {help_.get(option, '')}".rstrip() + f"\n    {spelled}: {typed(kind, choices)}"
    return lines


def typed_class(name: str, base: str, about: str, lines: dict[str, str]) -> str:
    """A class of options."""
    return "\n".join([f"\n\nclass {name}({base}, total=False):", f'    """{about}"""\n', *lines.values()]) + "\n"


def common(all_lines: list[dict[str, str]]) -> dict[str, str]:
    """The options that are the same in all commands."""
    first, *others = all_lines
    return {name: lines for name, lines in first.items() if all(other.get(name) == lines for other in others)}


def text() -> str:
    """The module."""
    parts = [HEAD]
    described = {command: described_options(command, own) for command, (_, own) in CLASSES.items()}
    shared = common(list(described.values()))
    parts.append(typed_class("SharedOptions", "TypedDict", "The options of every command.", shared))
    around = {command: lines for command, lines in described.items() if command != "warp3d"}
    framed = {name: lines for name, lines in common(list(around.values())).items() if name not in shared}
    parts.append(typed_class("FramedOptions", "SharedOptions", "The options of a camera around a scene.", framed))
    for command, (name, own) in CLASSES.items():
        base, known = ("FramedOptions", {**shared, **framed}) if command in around else ("SharedOptions", shared)
        lines = {option: words for option, words in described[command].items() if option not in known}
        parts.append(typed_class(f"{name}Options", base, f"The options of ``resample {command}``.", lines))
        picture = {"size": "Size"} | ({"transfer": "Any"} if "transfer" in own else {})
        further = {
            "Call": ("Options", "The options of a scene, with the view.", {"camera": "Any", "size": "Size"}),
            "Render": ("Options", "The options of a picture.", picture),
            "Pictures": ("Render", "The options of several pictures, with the camera.", {"camera": "Any"}),
        }
        for kind, (base, about, more) in further.items():
            lines = {option: f"    {option}: {kind_}" for option, kind_ in more.items()}
            parts.append(typed_class(f"{name}{kind}", f"{name}{base}", about, lines))
    return "".join(parts)


if __name__ == "__main__":
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write(text())
