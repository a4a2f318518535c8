# SPDX-License-Identifier: BSD-3-Clause
"""Exponents, and what a step takes by counting: products of the textbook, and instructions of the library's kernels."""
import math
import statistics

LEVELS = [("-O2", "gpp-O2"), ("-O3 -march=native", "gpp-O3-native")]


def exponent(points):
    """Least squares of log y against log x."""
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mean_x, mean_y = (statistics.fmean(v[i] for v in logs) for i in (0, 1))
    return sum((u - mean_x) * (v - mean_y) for u, v in logs) / sum((u - mean_x)**2 for u, _ in logs)


def products_ekf(n, p):
    """Multiplications of the loops of bench/limit.hpp and of the model, tests/models/dense.hpp."""
    model = n * n + 3 * n + 3 * n * p
    prediction = n**3 + n * n * (n + 1) / 2
    correction = p * n * n + n * p * (p + 1) / 2 + p**3 / 6 + n * p * p / 2 + 2 * n * p + p * n * (n + 1) / 2
    return model + prediction + correction


def products_jml(n, p):
    """The same of a step with four different matrices, whose P is not symmetric."""
    model = n * n + 5 * n + 5 * n * p
    return model + 2 * n**3 + 2 * p * n * n + n * p * p + p**3 / 3 + n * p * p + n * p + p * n * n


# ---- instructions, as the kernels are written (kernels.hpp, strips.hpp, rounding.hpp of the library) ----

def passes(length, width):
    """The packets of each pass over a column: at most eight, the widest that fit, 15 = 4 + 4 + 4 + 2 + 1."""
    found = []
    while length > 0:
        while width > length:
            width //= 2
        packets = min(length // width, 8)
        found.append(packets)
        length -= packets * width
    return found


def column(length, inner, vectors):
    """A column of a product: for each of its inner terms a coefficient to all lanes and a turn of the loop, for each packet
    load, multiply, add (two where one instruction multiplies and adds); its begin and its end."""
    term, turn = (2, 3) if vectors["fused"] else (3, 4)
    return sum(inner * (q * term + turn) + 2 * q + 2 for q in passes(length, vectors["width"]))


def lower(n, inner, vectors):
    """The lower triangle of a symmetric product, by blocks of the width of a packet."""
    width = vectors["width"]
    return sum(min(width, n - first) * column(n - first, inner, vectors) for first in range(0, n, width))


def copies(n, p, width):
    """What is moved and not multiplied: six matrices (A, Q, P, those of the report), and the model's own products."""
    return 6 * 3 * n * n / width + 3 * n * n / width + 16 * n + 3 * n * p + 2 * p * n + 6 * p


def instructions_ekf(n, p, vectors):
    """Of a step of jml::Ekf, n of 4 and more: prediction, correction, the proof that P is positive, copies. What a row's begin
    and end take (4, 14) and how many matrices are copied (6) was read off the code and the counts of g++ -O2, once, and is the
    same for all n, p and flags."""
    width = vectors["width"]
    prediction = n * column(n, n, vectors) + lower(n, n, vectors) + n * (n - 1)
    correction = (p * column(n, n, vectors) + p * p * n / width * 3 + p * p / 2 * n / width * 4 + p * n / width * 3
                  + lower(n, p, vectors) + n * (n - 1))
    proof = sum(math.ceil((n - i) / width) * 5 + 14 for k in range(n) for i in range(k + 1, n)) + 20 * n
    return prediction + correction + proof + copies(n, p, width)


def instructions_jml(n, p, vectors):
    """Of a step of jml::Jml: both products in full, none of them symmetric, no proof."""
    width = vectors["width"]
    prediction = 2 * n * column(n, n, vectors)
    correction = 2 * p * column(n, n, vectors) + p * p * n / width * 3 + p * p * n / width * 4 + n * column(n, p, vectors)
    return prediction + correction + copies(n, p, width) + 3 * n * n


VECTORS = {"-O2": {"width": 2, "fused": False}, "-O3 -march=native": {"width": 4, "fused": True}}
