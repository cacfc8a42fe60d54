"""Parser of pbrt scene files (version 4) for the directives and parameters that dermis writes."""

from __future__ import annotations

import re
from typing import NamedTuple

_TOKEN = re.compile(r'#[^\n]*|"((?:[^"\\\n])*)"|([\[\]])|([^\s"\[\]#]+)')
_NUMBERS = {"Scale": 3, "Translate": 3, "LookAt": 9}
_BARE = {"WorldBegin", "AttributeBegin", "AttributeEnd"}
_NAMES = {"Texture": 3}  # words in quotes before parameters; one of all others
_SURFACE = {
    "reflectance": "rgb|texture",
    "roughness": "float|texture",
    "remaproughness": "bool",
    "normalmap": "string",
}
_KNOWN: dict[str, dict[str, str]] = {
    "Camera perspective": {"fov": "float", "screenwindow": "float*"},
    "Sampler zsobol": {"pixelsamples": "integer"},
    "Integrator volpath": {"maxdepth": "integer"},
    "Film rgb": {"filename": "string", "xresolution": "integer", "yresolution": "integer"},
    "LightSource point": {"from": "point3", "I": "rgb"},
    "LightSource spot": {
        "from": "point3",
        "to": "point3",
        "I": "rgb",
        "coneangle": "float",
        "conedeltaangle": "float",
    },
    "LightSource distant": {"from": "point3", "to": "point3", "L": "rgb"},
    "LightSource infinite": {"L": "rgb"},
    "AreaLightSource diffuse": {"L": "rgb"},
    "Shape curve": {
        "type": "string",
        "basis": "string",
        "degree": "integer",
        "P": "point3*",
        "width0": "float",
        "width1": "float",
    },
    "Material hair": {
        "sigma_a": "rgb",
        "eta": "float",
        "beta_m": "float",
        "beta_n": "float",
        "alpha": "float",
    },
    "Shape bilinearmesh": {"P": "point3*"},
    "Shape sphere": {"radius": "float"},
    "Shape plymesh": {"filename": "string", "alpha": "texture"},
    "Texture imagemap": {"filename": "string", "encoding": "string", "wrap": "string"},
    "Material coateddiffuse": _SURFACE,
    "Material mix": {"materials": "string*", "amount": "texture"},
    "Material subsurface": {
        "reflectance": "rgb|texture",
        "mfp": "rgb",
        "scale": "float",
        "g": "float",
        "eta": "float",
        "roughness": "float|texture",
        "remaproughness": "bool",
        "normalmap": "string",
    },
}
_COUNT = {"float": 1, "integer": 1, "rgb": 3, "point3": 3, "string": 1, "texture": 1, "bool": 1}


class Directive(NamedTuple):
    """Directive with its keyword, quoted names, numbers, and parameters by name."""

    word: str
    names: list[str]
    numbers: list[float]
    parameters: dict[str, list[str]]


def read(text: str, worlds: int = 1) -> list[Directive]:
    """Return the directives of a file, or raise AssertionError where pbrt would report an error.

    worlds : number of directives WorldBegin, 0 for a file that another one includes
    """
    tokens = [found.groups() for found in _TOKEN.finditer(text) if not found[0].startswith("#")]
    assert not _TOKEN.sub("", text).strip(), "text that is not a token"
    directives, position, depth = [], 0, 0
    while position < len(tokens):
        word = tokens[position][2]
        assert word is not None, f"expected a directive, but got {tokens[position]}"
        one, position = _directive(word, tokens, position + 1)
        depth += (word == "AttributeBegin") - (word == "AttributeEnd")
        assert depth >= 0
        directives.append(one)
    assert depth == 0
    assert [one.word for one in directives].count("WorldBegin") == worlds
    return directives


def _directive(word: str, tokens: list[tuple[str, ...]], position: int) -> tuple[Directive, int]:
    if word in _BARE:
        return Directive(word, [], [], {}), position
    if word in _NUMBERS:
        end = position + _NUMBERS[word]
        return Directive(word, [], [float(one[2]) for one in tokens[position:end]], {}), end
    count = _NAMES.get(word, 1)
    names = [one[0] for one in tokens[position : position + count]]
    # The type of a named material is its first parameter.
    if word == "Include":
        return Directive(word, names, [], {}), position + count
    known = {"type": "string", **_SURFACE} if word == "MakeNamedMaterial" else _KNOWN[f"{word} {names[-1]}"]
    position, parameters = position + count, dict[str, list[str]]()
    while position < len(tokens) and tokens[position][0] is not None:
        kind, name = tokens[position][0].split(" ")
        assert name in known and kind in known[name].rstrip("*").split("|"), tokens[position]
        assert tokens[position + 1][1] == "["
        end = next(k for k in range(position + 2, len(tokens)) if tokens[k][1] == "]")
        values = [one[0] if kind in ("string", "texture") else one[2] for one in tokens[position + 2 : end]]
        assert None not in values
        _check(kind, values, several=known[name].endswith("*"))
        parameters[name], position = values, end + 1
    return Directive(word, names, [], parameters), position


def _check(kind: str, values: list[str], several: bool) -> None:
    assert several or len(values) == _COUNT[kind]
    if kind == "bool":
        assert values[0] in ("true", "false")
    elif kind not in ("string", "texture"):
        [float(value) for value in values]
