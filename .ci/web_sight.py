"""How far apart two colours look, with all kinds of cones and without one of them."""

import itertools
from math import atan2, cos, degrees, exp, hypot, radians, sin, sqrt

# Linear RGB as seen without one kind of cones, in full. Machado, Oliveira and Fernandes, IEEE TVCG 15(6), 2009, severity 1.0.
SIGHTS = {
    "all": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
    "tritanopia": ((1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)),
}
# Linear sRGB to CIE XYZ, each divided by that of D65 white.
TO_XYZ = ((0.4339, 0.3763, 0.1899), (0.2126, 0.7152, 0.0722), (0.0177, 0.1095, 0.8728))


def times(matrix, vector):
    return [sum(a * b for a, b in zip(row, vector)) for row in matrix]


def linear(colour):
    shares = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    return [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]


def cielab(rgb):
    x, y, z = (v ** (1 / 3) if v > 0.008856 else 7.787 * v + 16 / 116 for v in times(TO_XYZ, [min(1, max(0, v)) for v in rgb]))
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def ciede2000(one, other):
    """The distance of two colours in CIELAB. Sharma, Wu and Dalal, Color Research and Application 30(1), 2005, equations 2 to 22."""
    (l1, a1, b1), (l2, a2, b2) = one, other
    seventh = lambda c: sqrt(c**7 / (c**7 + 25**7))
    stretch = 1 + 0.5 * (1 - seventh((hypot(a1, b1) + hypot(a2, b2)) / 2))
    c1, c2 = hypot(stretch * a1, b1), hypot(stretch * a2, b2)
    h1, h2 = (degrees(atan2(b, stretch * a)) % 360 for a, b in ((a1, b1), (a2, b2)))
    is_grey = c1 * c2 == 0
    turn = 0 if is_grey else (h2 - h1 + 180) % 360 - 180
    if is_grey:
        hue = h1 + h2
    else:
        hue = (h1 + h2) / 2 if abs(h1 - h2) <= 180 else (h1 + h2 + (360 if h1 + h2 < 360 else -360)) / 2
    light, chroma = (l1 + l2) / 2, (c1 + c2) / 2
    t = 1 - 0.17 * cos(radians(hue - 30)) + 0.24 * cos(radians(2 * hue)) + 0.32 * cos(radians(3 * hue + 6)) - 0.20 * cos(radians(4 * hue - 63))
    by_light = (l2 - l1) / (1 + 0.015 * (light - 50) ** 2 / sqrt(20 + (light - 50) ** 2))
    by_chroma = (c2 - c1) / (1 + 0.045 * chroma)
    by_hue = 2 * sqrt(c1 * c2) * sin(radians(turn / 2)) / (1 + 0.015 * chroma * t)
    rotation = -sin(radians(60 * exp(-(((hue - 275) / 25) ** 2)))) * 2 * seventh(chroma)
    return sqrt(by_light**2 + by_chroma**2 + by_hue**2 + rotation * by_chroma * by_hue)


# Pairs of the paper's table 1 that take each branch of the hue.
for one, other, expected in (
    ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
    ((50, 2.49, -0.001), (50, -2.49, 0.0011), 7.2195),
    ((50, 2.5, 0), (73, 25, -18), 27.1492),
    ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
):
    assert abs(ciede2000(one, other) - expected) < 1e-4, (one, other, expected)


def difference(one, other):
    """The smallest distance of two colours (CIEDE2000) over all kinds of sight, and the kind that has it."""
    return min((ciede2000(*(cielab(times(matrix, linear(colour))) for colour in (one, other))), sight) for sight, matrix in SIGHTS.items())


def least_difference(colours, others=None):
    """The smallest distance of two of these colours, or of one of them and one of others, with the kind of sight and the colours."""
    pairs = itertools.combinations(colours, 2) if others is None else itertools.product(colours, others)
    return min((*difference(one, other), one, other) for one, other in pairs)


def contrast(one, other):
    """The contrast of two colours by WCAG 2."""
    light, dark = sorted((0.05 + times(TO_XYZ, linear(colour))[1] for colour in (one, other)), reverse=True)
    return light / dark
