"""Appendix A once more, with dictionaries of frozensets and plain loops: an independent second opinion."""

import math
from itertools import combinations

K = 0.25


def sim(a: frozenset, b: frozenset) -> float:
    return (len(a & b) + K) / (len(a | b) + K)


def term(b: float, c: float) -> float:
    return (b - c) * math.log(b / c)


def h_w(x: dict) -> float:
    total = sum(len(q) for q in x)
    core = -sum(len(q) / total * math.log(len(q) / total) for q in x)
    return core - sum(b * math.log(b) for b in x.values())


def h_in(x: dict) -> float:
    return h_w(x) + sum(term(x[q], x[r]) / sim(q, r) for q, r in combinations(x, 2))


def one_way(x: dict, y: dict) -> float:
    out = 0.0
    for q, b in x.items():
        best = max(sim(q, r) for r in y)
        ties = [c for r, c in y.items() if abs(sim(q, r) - best) < 1e-12]
        out += term(b, sum(ties) / len(ties)) / best
    return out


def div(x: dict, y: dict) -> float:
    return one_way(x, y) + one_way(y, x)


def dim(x: dict, y: dict) -> float:
    inner = h_in(x) + h_in(y)
    return 1.0 if inner + div(x, y) == 0 else inner / (inner + div(x, y))


def conductivity(y: dict, gamma: list[dict]) -> float:
    within = sum(h_in(x) for x in gamma)
    inner = within + 2 * sum(div(a, b) for a, b in combinations(gamma, 2))
    top = 1.0 if inner == 0 else within / inner
    total = 0.0
    for x in gamma:
        d = dim(y, x)
        if d <= top + 1e-12:
            total += d
        elif d / inner <= top:
            total += d / inner
    return total
