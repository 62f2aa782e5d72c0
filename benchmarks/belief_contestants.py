"""Contestants of ``belief.py``: bare kernels, evifuse, and the peers, on the same problems."""

import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numba
import numpy as np

from evifuse.belief import Frame, MassFunction, dempster, pcr5
from evifuse.belief.distance import jousselme

SEED = 7


@numba.njit(cache=True)
def bare_scan(sa, ma, sb, mb, size):
    """Dempster's rule by an array over all subsets."""
    sums = np.zeros(size)
    for i in range(sa.size):
        for j in range(sb.size):
            sums[sa[i] & sb[j]] += ma[i] * mb[j]
    total = 0.0
    for k in range(1, size):
        total += sums[k]
    sums[0] = 0.0
    return sums / total


@numba.njit(cache=True)
def bare_hash(sa, ma, sb, mb, bits):
    """Dempster's rule by a hash table."""
    size = 1 << bits
    keys = np.full(size, -1)
    sums = np.zeros(size)
    total = 0.0
    for i in range(sa.size):
        for j in range(sb.size):
            s = sa[i] & sb[j]
            if s == 0:
                continue
            v = ma[i] * mb[j]
            total += v
            at = np.int64((np.uint64(s) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(64 - bits))
            while keys[at] != -1 and keys[at] != s:
                at = (at + 1) & (size - 1)
            keys[at] = s
            sums[at] += v
    keep = keys >= 0
    return keys[keep], sums[keep] / total


@numba.njit(cache=True)
def bare_dense(a, b):
    """Dempster's rule by transforms."""
    n = a.size
    x, y = a.copy(), b.copy()
    half = 1
    while half < n:
        for start in range(0, n, 2 * half):
            for k in range(start, start + half):
                x[k] += x[k + half]
                y[k] += y[k + half]
        half *= 2
    for k in range(n):
        x[k] *= y[k]
    half = 1
    while half < n:
        for start in range(0, n, 2 * half):
            for k in range(start, start + half):
                x[k] -= x[k + half]
        half *= 2
    x[0] = 0.0
    return x / x.sum()


@numba.njit(cache=True)
def bare_batch(sa, ma, sb, mb, out_s, out_m, counts):
    """Dempster's rule of many pairs, each with a short list that is searched from the start."""
    for r in range(sa.shape[0]):
        count = 0
        total = 0.0
        for i in range(sa.shape[1]):
            for j in range(sb.shape[1]):
                s = sa[r, i] & sb[r, j]
                if s == 0:
                    continue
                v = ma[r, i] * mb[r, j]
                total += v
                k = 0
                while k < count and out_s[r, k] != s:
                    k += 1
                if k == count:
                    out_s[r, count] = s
                    out_m[r, count] = v
                    count += 1
                else:
                    out_m[r, k] += v
        for k in range(count):
            out_m[r, k] /= total
        counts[r] = count


@numba.njit(cache=True)
def bare_batch_scratch(sa, ma, sb, mb, bits, out_s, out_m, counts):
    """The same with an array over all subsets and a list of those that were met."""
    sums = np.zeros(1 << bits)
    met = np.empty(sa.shape[1] * sb.shape[1], np.int64)
    for r in range(sa.shape[0]):
        count = 0
        for i in range(sa.shape[1]):
            for j in range(sb.shape[1]):
                s = sa[r, i] & sb[r, j]
                if s == 0:
                    continue
                if sums[s] == 0.0:
                    met[count] = s
                    count += 1
                sums[s] += ma[r, i] * mb[r, j]
        total = 0.0
        for k in range(count):
            total += sums[met[k]]
        for k in range(count):
            out_s[r, k] = met[k]
            out_m[r, k] = sums[met[k]] / total
            sums[met[k]] = 0.0
        counts[r] = count


Work = Callable[[], Any]
Verdicts = list[tuple[str, bool]]


@dataclass
class Problem:
    """One question, who answers it, and what is asked of evifuse."""

    name: str
    contestants: dict[str, Work]
    judge: Callable[[dict[str, float]], Verdicts]
    reference: str = "bare kernel"
    left_out: list[str] = field(default_factory=list)
    slow: bool = False


def names(count: int) -> list[str]:
    return [f"h{i}" for i in range(count)]


def random_sets(rng: np.random.Generator, count: int, width: int) -> np.ndarray:
    return (rng.choice((1 << count) - 1, width, replace=False) + 1).astype(np.int64)


def labels(count: int, mask: int) -> list[str]:
    return [f"h{i}" for i in range(count) if mask >> i & 1]


def peers_of(
    count: int, sets: list[np.ndarray], masses: list[np.ndarray]
) -> tuple[dict[str, Work], list[str]]:
    """Every peer that can combine two sparse mass functions over so many hypotheses."""
    import evidencelib
    import pybelief
    import pyds
    import torch
    import torchbelief
    from evtools import DSVector
    from evtools.combinations import dempster as evtools_dempster

    out: dict[str, Work] = {}
    left: list[str] = []
    rows = list(zip(sets, masses, strict=True))
    if count <= 16:
        frame = torchbelief.Frame(count)
        dense = []
        for s, m in rows:
            values = torch.zeros(1 << count, dtype=torch.float64)
            values[torch.from_numpy(s)] = torch.from_numpy(m)
            dense.append(values)
        out["torchbelief"] = lambda: torchbelief.dempster(dense[0], dense[1], frame)
    else:
        sparse = [torchbelief.SparseMass(torch.from_numpy(s), torch.from_numpy(m), count) for s, m in rows]
        out["torchbelief"] = lambda: sparse[0].dempster(sparse[1])
    pairs = sets[0].size * sets[1].size
    if pairs <= 1 << 16:
        by_mask = [
            pybelief.MassFunction(names(count), dict(zip(s.tolist(), m.tolist(), strict=True)))
            for s, m in rows
        ]
        out["pybelief"] = lambda: by_mask[0].combine_dempster(by_mask[1])
        by_names = [
            pyds.MassFunction(
                {tuple(labels(count, s)): m for s, m in zip(a.tolist(), b.tolist(), strict=True)}
            )
            for a, b in rows
        ]
        out["py-dempster-shafer"] = lambda: by_names[0].combine_conjunctive(by_names[1])
    else:
        left.append("pybelief, py-dempster-shafer: pairs of dictionary entries, minutes")
    if pairs <= 1 << 20:
        vectors = [
            DSVector.from_focal(
                names(count),
                {",".join(labels(count, s)): m for s, m in zip(a.tolist(), b.tolist(), strict=True)},
            )
            for a, b in rows
        ]
        out["evtools"] = lambda: evtools_dempster(vectors[0], vectors[1])
    else:
        left.append("evtools: pairs of dictionary entries, minutes")
    if pairs <= 1 << 12 and count <= 10:
        exclusive = evidencelib.Frame(names(count), exclusive=True)
        found = [
            exclusive.mass({tuple(labels(count, s)): m for s, m in zip(a.tolist(), b.tolist(), strict=True)})
            for a, b in rows
        ]
        out["evidencelib"] = lambda: found[0].dempster(found[1])
    else:
        left.append("evidencelib: it lays out regions of the frame, minutes")
    return _working(out, left), left


def _working(candidates: dict[str, Work], left: list[str]) -> dict[str, Work]:
    """Peers that answer at all; an error is said, not hidden."""
    good: dict[str, Work] = {}
    for name, work in candidates.items():
        try:
            work()
        except (ArithmeticError, AttributeError, TypeError, ValueError) as e:
            left.append(f"{name}: {type(e).__name__}: {e}"[:110])
        else:
            good[name] = work
    return good


def best_peer(times: dict[str, float]) -> tuple[str, float]:
    rivals = {k: v for k, v in times.items() if k not in ("evifuse",) and not k.startswith("bare")}
    name = min(rivals, key=lambda k: rivals[k])
    return name, rivals[name]


def single(count: int, width: int | None, limit: float) -> Problem:
    """One combination through the public function."""
    rng = np.random.default_rng(SEED)
    frame = Frame(names(count))
    if width is None:
        sets = [np.arange(1, 1 << count), np.arange(1, 1 << count)]
        masses = [rng.dirichlet(np.ones((1 << count) - 1)) for _ in sets]
        dense = [np.concatenate([[0.0], m]) for m in masses]
        a, b = (MassFunction(frame, np.arange(1 << count), m) for m in dense)
        bare: Work = partial(bare_dense, *dense)
    else:
        sets = [random_sets(rng, count, width) for _ in range(2)]
        masses = [rng.dirichlet(np.ones(width)) for _ in sets]
        a, b = (MassFunction(frame, s, m) for s, m in zip(sets, masses, strict=True))
        if count <= 12:
            bare = partial(bare_scan, sets[0], masses[0], sets[1], masses[1], 1 << count)
        else:
            bare = partial(bare_hash, sets[0], masses[0], sets[1], masses[1], 13)
    peers, left = peers_of(count, sets, masses)

    def judge(times: dict[str, float]) -> Verdicts:
        ratio = times["evifuse"] / times["bare kernel"]
        name, seconds = best_peer(times)
        ahead = seconds / times["evifuse"]
        return [
            (f"within {limit:g}x of the bare kernel: {ratio:.2f}x", ratio <= limit),
            (f"ahead of every peer: {ahead:.1f}x ahead of {name}", ahead > 1),
        ]

    title = f"one combination, n = {count}, {'dense' if width is None else f'{width} sets'}"
    return Problem(
        title, {"bare kernel": bare, "evifuse": lambda: dempster(a, b), **peers}, judge, left_out=left
    )


def batch(count: int, rows: int = 10_000, width: int = 8) -> Problem:
    """Many pairs, each with focal sets of its own."""
    import pybelief
    import torch
    import torchbelief

    rng = np.random.default_rng(SEED)
    frame = Frame(names(count))
    sets = [np.stack([random_sets(rng, count, width) for _ in range(rows)]) for _ in range(2)]
    masses = [rng.dirichlet(np.ones(width), rows) for _ in range(2)]
    a, b = (MassFunction(frame, s, m) for s, m in zip(sets, masses, strict=True))
    small = min(width * width, 1 << count)

    def run(kernel: Any, *extra: int) -> Any:
        out_s, out_m = np.zeros((rows, small), np.int64), np.zeros((rows, small))
        counts = np.zeros(rows, np.int64)
        kernel(sets[0], masses[0], sets[1], masses[1], *extra, out_s, out_m, counts)
        return out_s, out_m, counts

    tb_frame = torchbelief.Frame(count)
    dense = []
    for s, m in zip(sets, masses, strict=True):
        values = torch.zeros((rows, 1 << count), dtype=torch.float64)
        values.scatter_(1, torch.from_numpy(s), torch.from_numpy(m))
        dense.append(values)
    loop = [
        [
            pybelief.MassFunction(names(count), dict(zip(s.tolist(), m.tolist(), strict=True)))
            for s, m in zip(ss, mm, strict=True)
        ]
        for ss, mm in zip(sets, masses, strict=True)
    ]
    contestants: dict[str, Work] = {
        "bare kernel": lambda: run(bare_batch_scratch, count),
        "bare kernel (list)": lambda: run(bare_batch),
        "evifuse": lambda: dempster(a, b),
        "torchbelief": lambda: torchbelief.dempster(dense[0], dense[1], tb_frame),
        "pybelief (loop)": lambda: [x.combine_dempster(y) for x, y in zip(*loop, strict=True)],
    }

    def judge(times: dict[str, float]) -> Verdicts:
        ratio = times["evifuse"] / times["bare kernel"]
        name, seconds = best_peer(times)
        ahead = seconds / times["evifuse"]
        verdicts = [(f"within 1.5x of the bare kernel: {ratio:.2f}x", ratio <= 1.5)]
        wanted = 50 if count == 10 else 1
        return [
            *verdicts,
            (f"{wanted}x ahead of the best peer: {ahead:.0f}x ahead of {name}", ahead >= wanted),
        ]

    return Problem(f"{rows:,} pairs of {width} focal sets, n = {count}", contestants, judge, slow=True)


def singletons() -> Problem:
    """Single hypotheses and the frame, the layout that classifiers give."""
    import torch
    from Dempster_Shafer_utils import Dempster_layer

    rng = np.random.default_rng(SEED)
    frame = Frame(names(10))
    masses = [rng.dirichlet(np.ones(11), 10_000) for _ in range(2)]
    a, b = (MassFunction(frame, [*frame.hypotheses, frame], m) for m in masses)
    layer = Dempster_layer()
    stacked = torch.from_numpy(np.stack(masses, axis=2))[..., None, None]

    def judge(times: dict[str, float]) -> Verdicts:
        ahead = times["ecolaf"] / times["evifuse"]
        return [(f"ahead of ecolaf: {ahead:.1f}x", ahead > 1)]

    contestants: dict[str, Work] = {"evifuse": lambda: dempster(a, b), "ecolaf": lambda: layer(stacked)}
    return Problem("10,000 pairs of singletons + frame, K = 10", contestants, judge, reference="evifuse")


def dense_measures() -> list[Problem]:
    """Jousselme's distance and PCR5 over all subsets."""
    import torch
    import torchbelief

    def dense(count: int) -> tuple[list[np.ndarray], list[MassFunction]]:
        rng = np.random.default_rng(SEED)
        values = [np.concatenate([[0.0], rng.dirichlet(np.ones((1 << count) - 1))]) for _ in range(2)]
        return values, [MassFunction(Frame(names(count)), np.arange(1 << count), v) for v in values]

    def judge(times: dict[str, float]) -> Verdicts:
        ahead = times["torchbelief"] / times["evifuse"]
        return [(f"100x ahead of torchbelief: {ahead:.0f}x", ahead >= 100)]

    problems: list[Problem] = []
    values, (a, b) = dense(12)
    frame12 = torchbelief.Frame(12)
    x, y = (torch.from_numpy(v) for v in values)
    problems.append(
        Problem(
            "Jousselme distance, n = 12 dense",
            {
                "evifuse": lambda: jousselme(a, b),
                "torchbelief": lambda: torchbelief.jousselme_distance(x, y, frame12),
            },
            judge,
            reference="evifuse",
            slow=True,
        )
    )
    values10, (c, d) = dense(10)
    frame10 = torchbelief.Frame(10)
    u, v = (torch.from_numpy(w) for w in values10)
    problems.append(
        Problem(
            "PCR5, n = 10 dense",
            {"evifuse": lambda: pcr5(c, d), "torchbelief": lambda: torchbelief.pcr5(u, v, frame10)},
            judge,
            reference="evifuse",
            slow=True,
        )
    )
    return problems


def problems() -> list[Problem]:
    """Everything that is asked, in order."""
    return [
        single(6, 8, 8.0),
        single(10, 64, 3.0),
        single(20, 64, 3.0),
        single(10, None, 3.0),
        single(16, None, 3.0),
        batch(6),
        batch(10),
        batch(12),
        singletons(),
        *dense_measures(),
    ]


def memory_ratio() -> float:
    """Peak memory of a batch operation over the size of its input and output."""
    rng = np.random.default_rng(SEED)
    frame = Frame(names(12))
    sets = [np.stack([random_sets(rng, 12, 8) for _ in range(1000)]).repeat(100, axis=0) for _ in range(2)]
    a, b = (MassFunction(frame, s, rng.dirichlet(np.ones(8), 100_000)) for s in sets)
    dempster(a[:10], b[:10])
    tracemalloc.start()
    joint, conflict = dempster(a, b)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    given = sum(m.masses.nbytes + m.focal_sets.nbytes for m in (a, b))
    result = joint.masses.nbytes + joint.focal_sets.nbytes + np.asarray(conflict).nbytes
    return (given + peak) / (given + result)
