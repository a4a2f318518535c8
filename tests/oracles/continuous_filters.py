# SPDX-License-Identifier: BSD-3-Clause
"""Reference solutions of the continuous filters, to 1e-18, and the instants at which three of them escape.

    python3 tests/oracles/continuous_filters.py | clang-format-19 > tests/filter/continuous_reference.hpp

The equations are (17)-(19) of Rusnak 2018 with the four slots of Table 1 of Rusnak 2015:

    x' = f(x) + P D^T R^-1 (y - m(x)),   P' = A P + P B^T + G Q G^T - P D^T R^-1 E P,

EKF (f_x, f_x, m_x, m_x), SDDRE (F, F, M, M), RNLS (F, f_x, m_x, M). They are integrated in 40-digit decimals
by Gragg's midpoint rule extrapolated over 2, 4, ... 2k substeps, once with k = 12 and once with k = 16 and
other steps; both must agree to 1e-20. Jacobians are written by hand and compared with differences, SDC
matrices with the function they factor. The escape times are roots of det X of Radon's lemma, P = Y X^-1.
Standard library only; about a minute.
"""

import sys
from decimal import Decimal as D, getcontext

getcontext().prec = 40
AGREEMENT = D("1e-20")


# ---- decimals: vectors, matrices, sine

def dec(text):
    """The numbers of a string, '1 2; 3 4' being a matrix."""
    rows = [[D(a) for a in row.split()] for row in text.split(";")]
    return rows if ";" in text else rows[0]


def product(a, b):
    columns = list(zip(*b))
    return [[sum(x * y for x, y in zip(row, column)) for column in columns] for row in a]


def apply(a, v):
    return [sum(x * y for x, y in zip(row, v)) for row in a]


def transpose(a):
    return [list(row) for row in zip(*a)]


def add(*terms):
    return [[sum(entries) for entries in zip(*rows)] for rows in zip(*terms)]


def negative(a):
    return [[-x for x in row] for row in a]


def identity(n):
    return [[D(int(i == j)) for j in range(n)] for i in range(n)]


def determinant(a):
    if len(a) == 1:
        return a[0][0]
    return sum((-1) ** j * a[0][j] * determinant([row[:j] + row[j + 1:] for row in a[1:]])
               for j in range(len(a)))


def inverse(a):
    """1x1 or 2x2."""
    if len(a) == 1:
        return [[1 / a[0][0]]]
    (p, q), (r, s) = a
    size = p * s - q * r
    return [[s / size, -q / size], [-r / size, p / size]]


def arctangent_of_reciprocal(n):
    total, term, k = D(0), D(1) / n, 0
    while abs(term) > D("1e-45"):
        total += term / (2 * k + 1) * (-1) ** k
        term /= n * n
        k += 1
    return total


TURN = 8 * (4 * arctangent_of_reciprocal(5) - arctangent_of_reciprocal(239))  # 2 pi, Machin


def sin(a):
    a = a.remainder_near(TURN)
    total, term, k = D(0), a, 1
    while abs(term) > D("1e-42"):
        total += term
        term *= -a * a / ((k + 1) * (k + 2))
        k += 2
    return total


def cos(a):
    return sin(a + TURN / 4)


# ---- extrapolated midpoint rule

def one_step(rate, t, z, h, k):
    """z(t + h) and an estimate of its error (that of the column before)."""
    start, tableau = rate(t, z), []
    for i in range(1, k + 1):
        n = 2 * i
        s = h / n
        before, now = z, [a + s * b for a, b in zip(z, start)]
        for j in range(1, n):
            slope = rate(t + j * s, now)
            before, now = now, [a + 2 * s * b for a, b in zip(before, slope)]
        row = [now]
        for j, last in enumerate(tableau[-1] if tableau else [], 1):
            ratio = (D(i) / (i - j)) ** 2 - 1
            row.append([a + (a - b) / ratio for a, b in zip(row[-1], last)])
        tableau.append(row)
    best, second = tableau[-1][-1], tableau[-1][-2]
    return best, max(abs(a - b) for a, b in zip(best, second))


def integrate(rate, z, times, k, tolerance):
    """z at each of the times, from t = 0; the estimated error of each step stays below tolerance."""
    t, h, out = D(0), D("0.001"), []
    for end in times:
        while t < end:
            s = min(h, end - t)
            trial, error = one_step(rate, t, z, s, k)
            if error <= tolerance:
                t, z = t + s, trial
            factor = (tolerance / max(error, D("1e-60"))) ** (D(1) / (2 * k - 1)) * D("0.8")
            h = s * min(max(factor, D("0.2")), D(2)) if s == h or factor < 1 else h
        out.append(z)
    return out


def twice(rate, z, times):
    """The integral by two rules with different steps, which must agree. Returns the better one."""
    coarse = integrate(rate, z, times, 12, D("1e-23"))
    fine = integrate(rate, z, times, 16, D("1e-28"))
    gap = max(abs(a - b) for p, q in zip(coarse, fine) for a, b in zip(p, q))
    if gap > AGREEMENT:
        sys.exit(f"the two integrations differ by {gap:.1e}")
    return fine, gap


# ---- models: n, p, f, F, f_x, m, M, m_x, G, Q, R, x(0), P(0), y(t)

class Oscillator:
    """Section 6 of Rusnak 2018, but for the start and a measurement without noise."""
    mu, c, k = D(1), D("0.01"), D("0.1")
    G, Q, R = dec("0;1"), [[D(1)]], [[D("1e-5")]]
    x, P = dec("1 0.5"), dec("0.001 0; 0 0.001")

    def y(self, t):
        return [D("0.8") * sin(D("0.7") * t + D("0.4")) + D("0.05") * cos(D("2.3") * t)]

    def f(self, x, t):
        return [x[1], -self.k / self.mu * x[0] - 2 * self.c / self.mu * (x[0] ** 2 - 1) * x[1]]

    def F(self, x, t):
        return [[D(0), D(1)], [-self.k / self.mu, -2 * self.c / self.mu * (x[0] ** 2 - 1)]]

    def f_x(self, x, t):
        return [[D(0), D(1)], [-(self.k + 4 * self.c * x[0] * x[1]) / self.mu,
                               -2 * self.c / self.mu * (x[0] ** 2 - 1)]]

    def m(self, x, t):
        return [x[0] / (1 + x[0] ** 2).sqrt()]

    def M(self, x, t):
        return [[1 / (1 + x[0] ** 2).sqrt(), D(0)]]

    def m_x(self, x, t):
        s = 1 + x[0] ** 2
        return [[1 / (s * s.sqrt()), D(0)]]


class TimeVarying:
    """Made up: full matrices, correlated R and Q, time in f and m, a control, f(0) and m(0) not 0."""
    u = D("0.3")
    G, Q = dec("0.4 -0.2; 0.1 0.7; 0.9 0.3"), dec("0.3 0.1; 0.1 0.5")
    R = dec("0.05 0.015; 0.015 0.08")
    x, P = dec("0.6 -0.4 0.8"), dec("0.5 0.1 -0.05; 0.1 0.4 0.08; -0.05 0.08 0.6")
    formulas = """
/// The time-varying example (models/time_varying.hpp), with x = (a, b, c), control u = 0.3:
///   F = [ -0.4 + 0.1 b    1 + 0.2 sin t    0.3 a         ]    f = F x + (0, u, 0.1 sin t)
///       [ -1.2            -0.5 - 0.2 a²    0.4 + u b     ]
///       [ 0.25 cos 2t     0.1 c - 0.3 u    -0.8 - 0.1 b² ]
///   M = [ 1 + 0.1 a²      0.2 c            0.3 cos t     ]    m = M x + (0, 0.1 sin 3t)
///       [ 0.1 b           -0.4             1 + 0.15 a    ]
///   G = [0.4 -0.2; 0.1 0.7; 0.9 0.3], Q = [0.3 0.1; 0.1 0.5], R = [0.05 0.015; 0.015 0.08],
/// and this y(t), measured without noise."""

    def y(self, t):
        return [D("0.9") * sin(D("1.1") * t) + D("0.3"),
                D("0.5") * cos(D("0.8") * t) - D("0.2") * sin(D("1.9") * t)]

    def f(self, x, t):
        a, b, c = x
        s = sin(t)
        return [D("-0.4") * a + D("0.1") * a * b + (1 + D("0.2") * s) * b + D("0.3") * a * c,
                D("-1.2") * a - D("0.5") * b - D("0.2") * a * a * b + D("0.4") * c + self.u * b * c + self.u,
                D("0.25") * cos(2 * t) * a + D("0.1") * b * c - D("0.3") * self.u * b - D("0.8") * c
                - D("0.1") * b * b * c + D("0.1") * s]

    def F(self, x, t):
        a, b, c = x
        return [[D("-0.4") + D("0.1") * b, 1 + D("0.2") * sin(t), D("0.3") * a],
                [D("-1.2"), D("-0.5") - D("0.2") * a * a, D("0.4") + self.u * b],
                [D("0.25") * cos(2 * t), D("0.1") * c - D("0.3") * self.u, D("-0.8") - D("0.1") * b * b]]

    def f_x(self, x, t):
        a, b, c = x
        return [[D("-0.4") + D("0.1") * b + D("0.3") * c, D("0.1") * a + 1 + D("0.2") * sin(t), D("0.3") * a],
                [D("-1.2") - D("0.4") * a * b, D("-0.5") - D("0.2") * a * a + self.u * c,
                 D("0.4") + self.u * b],
                [D("0.25") * cos(2 * t), D("0.1") * c - D("0.3") * self.u - D("0.2") * b * c,
                 D("0.1") * b - D("0.8") - D("0.1") * b * b]]

    def m(self, x, t):
        a, b, c = x
        return [a + D("0.1") * a ** 3 + D("0.2") * b * c + D("0.3") * cos(t) * c,
                D("0.1") * a * b - D("0.4") * b + c + D("0.15") * a * c + D("0.1") * sin(3 * t)]

    def M(self, x, t):
        a, b, c = x
        return [[1 + D("0.1") * a * a, D("0.2") * c, D("0.3") * cos(t)],
                [D("0.1") * b, D("-0.4"), 1 + D("0.15") * a]]

    def m_x(self, x, t):
        a, b, c = x
        return [[1 + D("0.3") * a * a, D("0.2") * c, D("0.2") * b + D("0.3") * cos(t)],
                [D("0.1") * b + D("0.15") * c, D("0.1") * a - D("0.4"), 1 + D("0.15") * a]]


class Stationary:
    """Stays where it starts: f(x(0)) = 0 and y = m(x(0))."""

    def y(self, t):
        return self.m(self.x, t)


class EscapingCopies(Stationary):
    """n times f = 2 x (x - 1), m = x (3 - 2 x) at x = 1: F = 0, f_x = 2, M = 1, m_x = -1."""

    def __init__(self, n):
        self.n, self.x = n, [D(1)] * n
        self.G = self.Q = self.R = identity(n)
        self.P = [[entry / 2 for entry in row] for row in identity(n)]

    def diagonal(self, values):
        return [[v if i == j else D(0) for j in range(self.n)] for i, v in enumerate(values)]

    def f(self, x, t):
        return [2 * a * (a - 1) for a in x]

    def F(self, x, t):
        return self.diagonal([2 * (a - 1) for a in x])

    def f_x(self, x, t):
        return self.diagonal([4 * a - 2 for a in x])

    def m(self, x, t):
        return [a * (3 - 2 * a) for a in x]

    def M(self, x, t):
        return self.diagonal([3 - 2 * a for a in x])

    def m_x(self, x, t):
        return self.diagonal([3 - 4 * a for a in x])


class EscapingPair(Stationary):
    """f = (b - a/2, b (0.75 - a)), m = a - a^3 at (0.75, 0.375), where M > 0 > m_x."""
    G, Q, R = dec("0.5;1"), [[D(1)]], [[D("0.125")]]
    x, P = dec("0.75 0.375"), dec("0.5 0.125; 0.125 0.25")

    def f(self, x, t):
        return [x[1] - x[0] / 2, x[1] * (D("0.75") - x[0])]

    def F(self, x, t):
        return [[D("-0.5"), D(1)], [-x[1], D("0.75")]]

    def f_x(self, x, t):
        return [[D("-0.5"), D(1)], [-x[1], D("0.75") - x[0]]]

    def m(self, x, t):
        return [x[0] - x[0] ** 3]

    def M(self, x, t):
        return [[1 - x[0] ** 2, D(0)]]

    def m_x(self, x, t):
        return [[1 - 3 * x[0] ** 2, D(0)]]


def check_model(model):
    """F x = f - f(0), M x = m - m(0), and the Jacobians against central differences, away from the start."""
    t, h, n = D("0.37"), D("1e-10"), len(model.x)
    x = [a + D("0.21") * (i + 1) for i, a in enumerate(model.x)]
    for function, sdc, jacobian in ((model.f, model.F, model.f_x), (model.m, model.M, model.m_x)):
        change = [a - b for a, b in zip(function(x, t), function([D(0)] * n, t))]
        worst = max(abs(a - b) for a, b in zip(change, apply(sdc(x, t), x)))
        for j in range(n):
            up, down = ([a + sign * h * (i == j) for i, a in enumerate(x)] for sign in (1, -1))
            slope = [(a - b) / (2 * h) for a, b in zip(function(up, t), function(down, t))]
            worst = max([worst] + [abs(a - row[j]) for a, row in zip(slope, jacobian(x, t))])
        if worst > D("1e-18"):
            sys.exit(f"{type(model).__name__}: a derivative or an SDC matrix is wrong by {worst:.1e}")


# ---- filters and escapes

RULES = {"ekf": ("f_x", "f_x", "m_x", "m_x"), "sddre": ("F", "F", "M", "M"), "rnls": ("F", "f_x", "m_x", "M")}


def filter_rate(model, rule):
    """The right-hand side in the unknowns (x, P by rows)."""
    n, names = len(model.x), RULES[rule]
    noise, weight = product(product(model.G, model.Q), transpose(model.G)), inverse(model.R)

    def rate(t, z):
        x, P = z[:n], [z[n + n * i:n + n * (i + 1)] for i in range(n)]
        A, B, Dm, E = (getattr(model, name)(x, t) for name in names)
        K = product(product(P, transpose(Dm)), weight)
        innovation = [a - b for a, b in zip(model.y(t), model.m(x, t))]
        dx = [a + b for a, b in zip(model.f(x, t), apply(K, innovation))]
        dP = add(product(A, P), product(P, transpose(B)), noise, negative(product(K, product(E, P))))
        return dx + [entry for row in dP for entry in row]

    return rate


def samples(model, rule, times):
    check_model(model)
    start = list(model.x) + [entry for row in model.P for entry in row]
    return twice(filter_rate(model, rule), start, [D(t) for t in times])


def escape_time(model):
    """First root of det X, P = Y X^-1: X' = -B^T X + D^T R^-1 E Y, Y' = G Q G^T X + A Y, x at rest, RNLS."""
    check_model(model)
    n, t = len(model.x), D(0)
    x, weight = model.x, inverse(model.R)
    A, Bt = model.F(x, t), transpose(model.f_x(x, t))
    gain = product(product(transpose(model.m_x(x, t)), weight), model.M(x, t))
    noise = product(product(model.G, model.Q), transpose(model.G))

    def rate(t, z):
        X, Y = ([z[o + n * i:o + n * (i + 1)] for i in range(n)] for o in (0, n * n))
        parts = add(negative(product(Bt, X)), product(gain, Y)), add(product(noise, X), product(A, Y))
        return [entry for part in parts for row in part for entry in row]

    def det(z):
        return determinant([z[n * i:n * (i + 1)] for i in range(n)])

    z = [entry for part in (identity(n), model.P) for row in part for entry in row]
    h = D("0.05")
    for _ in range(1000):
        after = one_step(rate, t, z, h, 16)[0]
        if det(after) <= 0:
            break
        t, z = t + h, after
    low, high = D(0), h
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (low, middle) if det(one_step(rate, t, z, middle, 16)[0]) <= 0 else (middle, high)
    return t + low


# ---- the header

def number(a):
    return f"{a:.20g}"


def listed(values):
    return ", ".join(number(a) for a in values)


def table(name, model, times, comment):
    print(f"\n/// {comment}")
    n, worst = len(model.x), D(0)
    for rule in RULES:
        values, gap = samples(model, rule, times)
        worst = max(worst, gap)
        print(f"inline constexpr std::array<Sample<{n}>, {len(times)}> {name}_{rule}{{{{")
        print(",".join(f"{{{t}, {{{listed(z[:n])}}}, {{{listed(z[n:])}}}}}" for t, z in zip(times, values)))
        print("}};")
    print(f"{name}: the two integrations agree to {worst:.1e}", file=sys.stderr)


def start(name, model):
    x, P = ", ".join(str(a) for a in model.x), ", ".join(str(entry) for row in model.P for entry in row)
    print(f"inline constexpr Sample<{len(model.x)}> {name}_start{{0, {{{x}}}, {{{P}}}}};")


def main():
    print("""// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Solutions of the continuous EKF, SDDRE and RNLS filters, and escape times of their Riccati equation, found
/// without the library: printed by tests/oracles/continuous_filters.py, which says how.
///
/// The decimals written here are right to 1e-18 of the equations with the decimal constants below; what a
/// test may demand is set by double precision. P is listed by rows.
#pragma once

#include <array>
#include <cmath>

namespace continuous_reference {

/// x(t) and P(t), by rows.
template <int n>
struct Sample {
  double time;
  std::array<double, n> x;
  std::array<double, n * n> P;
};

/// The oscillator of section 6 of Rusnak 2018 (models/continuous.hpp, its defaults: µ = 1, c = 0.01, k = 0.1,
/// Q = 1, R = 1e-5), fed with this y(t), which is the measured output and holds no noise.
inline double oscillator_signal(double t) { return 0.8 * std::sin(0.7 * t + 0.4) + 0.05 * std::cos(2.3 * t); }
""")
    start("oscillator", Oscillator())
    table("oscillator", Oscillator(), ["0.5", "1", "2", "5", "10", "20"],
          "Table 1's rows on the oscillator, t in s.")
    print(TimeVarying.formulas)
    print("""inline std::array<double, 2> time_varying_signal(double t) {
  return {0.9 * std::sin(1.1 * t) + 0.3, 0.5 * std::cos(0.8 * t) - 0.2 * std::sin(1.9 * t)};
}
inline constexpr double time_varying_control = 0.3;""")
    start("time_varying", TimeVarying())
    table("time_varying", TimeVarying(), ["1", "2", "4"], "Table 1's rows on the time-varying example.")

    copies = [escape_time(EscapingCopies(1))]
    if abs(copies[0] - D(2) / 3) > AGREEMENT:
        sys.exit(f"the scalar escape is not at 2/3 but at {copies[0]}")
    pair = escape_time(EscapingPair())
    before = [str((pair * share).quantize(D("0.001"))) for share in (D("0.5"), D("0.9"))]
    values, gap = samples(EscapingPair(), "rnls", before)
    print(f"escaping_pair: the two integrations agree to {gap:.1e}", file=sys.stderr)
    print("""
/// Escapes (models/escaping.hpp): x rests at the start, y = m(x), and P of the RNLS filter goes to infinity
/// though Q ≥ 0 and R > 0, since M and m_x have opposite signs.
///
/// EscapingCopies<n>, y = 1: n times P' = 2 P + 1 + P², P(0) = 1/2. P(t) = 1/(2/3 - t) - 1, continued to
/// P(1) = -4 behind the pole. det X of P = Y X⁻¹ is (1 - 3t/2)ⁿ e^(-nt): for even n it does not change sign.
inline constexpr double escaping_copies_time = 2.0 / 3;
inline double escaping_copies_variance(double t) { return 1 / (2.0 / 3 - t) - 1; }
""")
    print("/// EscapingPair, y = 0.328125: P becomes nonsymmetric, and all its entries escape at once.")
    start("escaping_pair", EscapingPair())
    print(f"inline constexpr double escaping_pair_time = {pair:.19f};")
    print(f"inline constexpr std::array<Sample<2>, {len(before)}> escaping_pair_rnls{{{{")
    print(",".join(f"{{{t}, {{{listed(z[:2])}}}, {{{listed(z[2:])}}}}}" for t, z in zip(before, values)))
    print("}};\n\n}  // namespace continuous_reference")


if __name__ == "__main__":
    main()
