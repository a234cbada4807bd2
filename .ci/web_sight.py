"""How far apart two colours look, with all kinds of cones and without one of them."""

import itertools

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


def least_difference(colours):
    """The smallest distance of two colours in CIELAB (ΔE 1976), whoever looks; and who and which."""
    found = []
    for one, other in itertools.combinations(colours, 2):
        for sight, matrix in SIGHTS.items():
            pair = [cielab(times(matrix, linear(colour))) for colour in (one, other)]
            found.append((sum((a - b) ** 2 for a, b in zip(*pair)) ** 0.5, sight, one, other))
    return min(found)


def contrast(one, other):
    """The contrast of two colours by WCAG 2."""
    light, dark = sorted((0.05 + times(TO_XYZ, linear(colour))[1] for colour in (one, other)), reverse=True)
    return light / dark
