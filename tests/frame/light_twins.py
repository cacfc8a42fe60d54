"""Reference implementations of environments, area lights, soft shadows, bloom and tone curves in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
ROUGH, VIEWS, LOBES = 12, 16, 5  # of the table of mirrors
LEVELS = 13  # of reflections
RANGE = np.log(1 / 0.018)  # of their roughness, from the smoothest to the roughest
MIRROR_RANGE = np.log(20.0)  # of the roughness in the table, from 0.05


def dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=-1))


def unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def panorama_at(layer: Floats, environment: Any, direction: Floats) -> Floats:
    """Return (..., 3) of a panorama's layer (h, w, 3), bilinear, rotated and exposed."""
    cosine, sine = environment["turn"].astype(float)
    x, y, z = np.moveaxis(direction, -1, 0)
    turned = cosine * x - sine * z, sine * x + cosine * z
    height, width = layer.shape[:2]
    column = (0.5 + np.arctan2(turned[0], -turned[1]) / (2 * np.pi)) * width - 0.5
    row = np.arccos(np.clip(y, -1, 1)) / np.pi * height - 0.5
    left, top = np.floor(column).astype(int), np.floor(row).astype(int)
    total = np.zeros(direction.shape)
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - i - (row - top)) * np.abs(1 - j - (column - left))
            inside = np.clip(top + i, 0, height - 1)
            around = left + j + np.where(inside == top + i, 0, width // 2)  # over a pole, to its other side
            total += weight[..., None] * layer[inside, around % width]
    return total * float(environment["exposure"])


def reflection(layers: Floats, environment: Any, direction: Floats, m: Floats) -> Floats:
    """Return the (..., 3) mean radiance under isotropic lobes, between two layers of roughness."""
    place = (LEVELS - 1) * np.clip(np.log(m / 0.018) / RANGE, 0, 1)
    low = np.minimum(place.astype(int), LEVELS - 2)
    read = np.stack([panorama_at(layer, environment, direction) for layer in layers[1:]])
    rows, columns = np.indices(m.shape)
    f = (place - low)[..., None]
    return np.asarray((1 - f) * read[low, rows, columns] + f * read[low + 1, rows, columns])


def ambient(layers: Floats, environment: Any, normal: Floats, open_: Floats, albedo: Floats) -> Floats:
    """Return the (..., 3) irradiance of a partly occluded surface with interreflection [Jimenez2016]."""
    a, b, c = 2.0404 * albedo - 0.3324, -4.7951 * albedo + 0.6417, 2.7552 * albedo + 0.6903
    x = open_[..., None]
    return panorama_at(layers[0], environment, normal) * np.maximum(x, ((x * a + b) * x + c) * x)


def mirrored(
    layers: Floats, environment: Any, smooth: Floats, normal: Floats, view: Floats, m: Floats, open_: Floats
) -> Floats:
    """Return the (..., 3) radiance that the surface's lobe reflects."""
    cosine = np.clip(dot(normal, view), 0, 1)
    x, y = np.sqrt(cosine) * (VIEWS - 1), np.clip(np.log(m / 0.05) / MIRROR_RANGE, 0, 1) * (ROUGH - 1)
    j, i = np.minimum(x.astype(int), VIEWS - 2), np.minimum(y.astype(int), ROUGH - 2)
    table = environment["mirrors"].astype(float).reshape(ROUGH, VIEWS, LOBES, 4)
    fx, fy = (x - j)[..., None, None], (y - i)[..., None, None]
    low = (1 - fx) * table[i, j] + fx * table[i, j + 1]
    high = (1 - fx) * table[i + 1, j] + fx * table[i + 1, j + 1]
    lobes = np.moveaxis((1 - fy) * low + fy * high, -2, 0)
    across = cosine[..., None] * normal - view
    sine = np.linalg.norm(across, axis=-1, keepdims=True)
    along = across / np.maximum(sine, 1e-6)
    ahead, away = 2.0 * cosine[..., None] * normal - view, cosine[..., None] * along - sine * normal
    aside = np.cross(normal, along)
    seen = np.clip((cosine + open_) ** np.exp2(-16 * m - 1) - 1 + open_, 0, 1)
    total = np.zeros_like(normal)
    for mirror in lobes:
        x, y = mirror[..., :1], mirror[..., 1:2]
        direction = unit(2.0 * (x * away + y * aside) + (1.0 - x**2 - y**2) * ahead)
        risen = np.clip(1 + dot(direction, smooth) / m, 0, 1)[..., None]
        total += mirror[..., 3:] * risen * reflection(layers, environment, direction, mirror[..., 2])
    return np.asarray(total * seen[..., None])


def part_of(light: Any, points: Floats, part: int) -> tuple[Floats, Floats]:
    """Return (..., 3) directions to a part of a rectangle or sphere, and the irradiance that faces it.

    light : the shader's record
    """
    side = int(light["side"])
    place = (2.0 * np.array([part % side, part // side]) + 1.0) / side - 1.0
    radiance = light["irradiance"].astype(float)
    u, v, position = (light[name].astype(float) for name in ("half_u", "half_v", "position"))
    if not light["round"]:
        d = position + place[0] * u + place[1] * v - points
        to_light = unit(d)
        area = 4.0 * np.linalg.norm(u) * np.linalg.norm(v) / side**2
        facing = np.maximum(0.0, -dot(to_light, light["direction"].astype(float)))
        return to_light, radiance * (facing * area / dot(d, d))[..., None]
    d = position - points
    sine2 = np.minimum(dot(u, u) / dot(d, d), 1.0)
    if abs(place[0]) <= abs(place[1]):
        r, phi = place[1], 0.5 * np.pi - 0.25 * np.pi * place[0] / place[1]
    else:
        r, phi = place[0], 0.25 * np.pi * place[1] / place[0]
    w = unit(d)
    sign = np.where(w[..., 2] >= 0, 1.0, -1.0)
    a = -1.0 / (sign + w[..., 2])
    b = w[..., 0] * w[..., 1] * a
    first = np.stack([1 + sign * w[..., 0] ** 2 * a, sign * b, -sign * w[..., 0]], axis=-1)
    second = np.stack([b, sign + w[..., 1] ** 2 * a, -w[..., 1]], axis=-1)
    sine = r * np.sqrt(sine2)
    cosine = np.sqrt(1.0 - sine**2)
    across = np.cos(phi) * first + np.sin(phi) * second
    to_light = sine[..., None] * across + cosine[..., None] * w
    return to_light, radiance * (np.pi * sine2 / cosine / side**2)[..., None]


def visibility(light: Any, nearness: Floats, points: Floats, normals: Floats) -> Floats:
    """Return the (n,) fraction of a light's irradiance that arrives, by rays through its depth map (s, s).

    Rays are weighted by the cosine of incidence.

    light : the shader's record, points and normals : (n, 3)
    """
    right, up = light["map_right"].astype(float), light["map_up"].astype(float)
    frame = np.stack([right, up, np.cross(up, right)])
    near, far, texel = (float(light[name]) for name in ("map_near", "map_far", "texel"))
    parallel = bool(light["parallel"])
    p, n = (points - light["position"].astype(float)) @ frame.T, normals @ frame.T
    depth, height = p[:, 2], dot(n, p)
    place = p[:, :2] if parallel else p[:, :2] / depth[:, None]
    least = np.maximum(float(light["softness"]) / (1.0 if parallel else depth), 1.5 * texel)

    def on_line(step: float) -> Floats:
        way = min(1.0, (step / 8) ** 2.5)
        if parallel:
            return np.asarray((1 - way) * depth + way * near)
        return np.asarray(1 / ((1 - way) / depth + way / near))

    heights, hidden = [], []
    for index in range(int(light["rays"])):
        even = (0.5 + (2016 + index // 2) * np.array([0.7548776662, 0.5698402910])) % 1
        turn = 2 * np.pi * even[1]
        disc = np.sqrt(even[0]) * np.array([np.cos(turn), np.sin(turn)])
        spot = (-1) ** index * (2 * even - 1 if not light["round"] else disc)
        lateral = spot * light["extent"].astype(float)
        towards = np.array([*lateral, -1.0]) if parallel else np.column_stack([lateral - p[:, :2], -depth])
        heights.append(dot(n, np.broadcast_to(towards, n.shape)))
        blocked = np.zeros(len(points), bool)
        for k in range(8):
            d = on_line(k + 0.5)
            lean = depth - d if parallel else 1 / d - 1 / depth
            line = place + lateral * lean[:, None] + spot * np.broadcast_to(least, depth.shape)[:, None]
            at = np.floor(0.5 * len(nearness) + line * [1, -1] / texel).astype(int)
            held = nearness[at[:, 1], at[:, 0]]
            found = far + held * (near - far) if parallel else near * far / (held * (far - near) + near)
            scale = 1.0 if parallel else found[:, None]
            blocker = np.column_stack([scale * line, found])
            slack = 2 * texel * (1.0 if parallel else found)
            thick = np.maximum(4.0, 1.5 * (d - on_line(k + 1.5)))
            behind = d - found
            blocked |= (held > 0) & (behind > 0) & (behind < thick) & (dot(n, blocker) - height > slack)
        hidden.append(blocked)
    height_above, blocked = np.array(heights), np.array(hidden)
    above = height_above > 0
    first = above & (np.cumsum(above, axis=0) <= max(len(above) // 4, 8))
    few = (blocked & first).sum(axis=0) / np.maximum(first.sum(axis=0), 1)
    share = (blocked * above * height_above).sum(axis=0) / np.maximum(
        (above * height_above).sum(axis=0), 1e-12
    )
    return np.where(above.any(axis=0), 1 - np.where((few == 0) | (few == 1), few, share), 0.0)


def halved(picture: Floats) -> Floats:
    """Return a picture at half the size, filtered by 1 3 3 1 along both axes."""
    height, width = picture.shape[:2]
    y, x = 2 * np.arange(max(1, height // 2)), 2 * np.arange(max(1, width // 2))
    taps = ((-1, 1), (0, 3), (1, 3), (2, 1))
    total = np.zeros((len(y), len(x), picture.shape[2]))
    for i, wy in taps:
        for j, wx in taps:
            rows, columns = np.clip(y + i, 0, height - 1), np.clip(x + j, 0, width - 1)
            total += wy * wx / 64 * picture[np.ix_(rows, columns)]
    return total


def widened(picture: Floats, size: tuple[int, int]) -> Floats:
    """Return a picture at a larger size (height, width), bilinear."""
    y, x = ((np.arange(n) + 0.5) / n * m - 0.5 for n, m in zip(size, picture.shape[:2], strict=True))
    rows, columns = np.floor(y).astype(int), np.floor(x).astype(int)
    total = np.zeros((*size, picture.shape[2]))
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - i - (y - rows))[:, None] * np.abs(1 - j - (x - columns))[None, :]
            at = np.ix_(
                np.clip(rows + i, 0, picture.shape[0] - 1), np.clip(columns + j, 0, picture.shape[1] - 1)
            )
            total += weight[..., None] * picture[at]
    return total


def bloomed(picture: Floats, share: float, count: int) -> Floats:
    """Return a picture with a fraction of its light scattered over `count` halvings."""
    levels = [halved(picture)]
    for _ in range(count - 1):
        levels.append(halved(levels[-1]))
    total = levels.pop()
    while levels:
        own = levels.pop()
        total = own + widened(total, own.shape[:2])
    return (1.0 - share) * picture + share / count * widened(total, picture.shape[:2])


def filmic(linear: Floats) -> Floats:
    """Return the filmic curve as printed in [Hable2010], white at 11.2."""

    def curve(x: Floats | float) -> Any:
        shoulder, slope, angle, toe, a, b = 0.15, 0.50, 0.10, 0.20, 0.02, 0.30
        top = x * (shoulder * x + angle * slope) + toe * a
        return top / (x * (shoulder * x + slope) + toe * b) - a / b

    return np.asarray(curve(2.0 * linear) / curve(11.2))


def neutral(linear: Floats) -> Floats:
    """Return the neutral tone mapping of its specification [Khronos2024]."""
    start, desaturation = 0.8 - 0.04, 0.15
    x = linear.min(axis=-1, keepdims=True)
    colour = linear - np.where(x < 0.08, x - 6.25 * x * x, 0.04)
    peak = colour.max(axis=-1, keepdims=True)
    d = 1.0 - start
    above = np.maximum(peak, start)
    new_peak = 1.0 - d * d / (above + d - start)
    g = 1.0 - 1.0 / (desaturation * (above - new_peak) + 1.0)
    pressed = (1.0 - g) * colour * new_peak / np.maximum(above, 1e-9) + g * new_peak
    return np.where(peak < start, colour, pressed)
