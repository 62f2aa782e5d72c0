"""The compiled fits in NumPy, as they read on paper: what the fast ones are held against."""

import numpy as np

from evifuse.touch._kernels_patch import linearise
from tests.touch.twins import least_squares


def site_roundings(centres, normals, radius, least_turn, pieces, fewest, narrowest, limits):
    """Rows (2, 5) of each roll: inner edge and best arc; places and normals are in the site's frame."""
    cut = [_pieces(*roll, pieces) for roll in zip(centres, normals, strict=True)]
    bend = _bend([place for place, _, _ in cut], narrowest)
    return np.array([_of_roll(*own, bend, radius, least_turn, fewest, limits) for own in cut])


def _pieces(centre, normal, most):
    count = min(most, len(centre) // 3)
    cuts = np.arange(count) * len(centre) // count
    size = np.diff(np.append(cuts, len(centre)))[:, None]
    second = np.median(np.abs(np.diff(centre[:, 2], 2))) / (0.6745 * np.sqrt(6))
    means = [np.add.reduceat(rows, cuts) / size for rows in (centre, normal)]
    return *means, second / np.sqrt(len(centre) / count)


def _bend(places, narrowest):
    """How the height bends, a matrix (2, 2); None if rolls have one direction only."""
    ways = [np.arctan2(*(place[-1, :2] - place[0, :2])[::-1]) % np.pi for place in places]
    ordered = np.sort(ways)
    if np.pi - np.diff(np.append(ordered, ordered[0] + np.pi)).max() < narrowest:
        return None
    x, y, z = np.concatenate(places).T
    scale = max(np.abs([x, y]).max(), 1e-12)
    x, y = x / scale, y / scale
    rows = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    _, _, _, xx, xy, yy = np.linalg.solve(rows.T @ rows + 1e-9 * len(x) * np.eye(6), rows.T @ z)
    return np.array([[2 * xx, xy], [xy, 2 * yy]])


def _of_roll(place, normal, steady, bend, radius, least_turn, fewest, limits):
    floor, stick, leaning, wide, still_share = limits
    across, turn, doubt = _turn(place, normal, bend)
    found = np.zeros((2, 5))
    found[:, 1] = np.arctan2(across[1], across[0]) % np.pi
    first, last = np.triu_indices(len(turn), 1)
    total = turn[last] - turn[first]
    kept = total >= least_turn
    if not kept.any():
        return found
    first, last, total = first[kept], last[kept], total[kept]
    x, z = place[:, :2] @ across, place[:, 2]
    aside = place[:, :2] @ np.array([-across[1], across[0]])
    forward = x[last] - x[first]
    chord = np.hypot(forward, z[last] - z[first])
    height = np.hypot(steady, floor)
    still = chord + 2 * height <= still_share * radius * total
    if still.any():
        furthest = np.argmax(np.where(still, total, 0.0))
        found[0, [0, 2, 3]] = chord[furthest], total[furthest], 1
    arc = (last - first >= fewest - 1) & (forward > 0)
    if not arc.any() or (chord / (2 * np.sin(np.minimum(total, 3.0) / 2)))[arc].min() > wide * radius:
        return found
    first, last, total = first[arc], last[arc], total[arc]
    second = np.percentile(np.abs(np.diff(turn, 2)), 75) / (1.15 * np.sqrt(6))
    angle = np.hypot(second, stick)
    reach, error = _arcs(np.stack([x, z], axis=1) / radius, turn, first, last, height / radius, angle)
    lean = angle / total if doubt is None else max(doubt, leaning)
    error = np.hypot(error, np.abs(aside[last] - aside[first]) * lean / total / radius)
    best = np.argmin(error)
    found[1, [0, 2, 3, 4]] = radius * (reach[best] - 1), total[best], 1, radius * error[best]
    return found


def _turn(place, normal, bend):
    """Direction in which the normal turns, its angle in that plane, and a doubt."""
    flat = normal[:, :2] - normal[:, :2].mean(axis=0)
    across, doubt = np.linalg.eigh(flat.T @ flat)[1][:, 1], None
    if bend is not None:
        bent = bend @ (place[-1, :2] - place[0, :2])
        bent = bent / np.linalg.norm(bent)
        across, doubt = bent, np.arccos(min(abs(across @ bent), 1.0))
    if across @ (normal[-1, :2] - normal[0, :2]) < 0:
        across = -across
    return across, np.unwrap(np.arctan2(normal[:, :2] @ across, normal[:, 2])), doubt


def _arcs(place, turn, first, last, height, aside):
    """Radii of the arcs through pieces first to last of a way, and their standard errors, one by one."""
    radii, errors = [], []
    for low, high in zip(first, last + 1, strict=True):
        (x, z), one, angle = place[low:high].T, np.ones(high - low), turn[low:high]
        circle = np.stack([2 * x, 2 * z, one], axis=1) / (2 * height)
        facing = np.stack([np.cos(angle), -np.sin(angle), 0 * one], axis=1) / aside
        rows = np.concatenate([circle, facing])
        values = np.concatenate(
            [(x * x + z * z) / (2 * height), (x * np.cos(angle) - z * np.sin(angle)) / aside]
        )
        system = rows.T @ rows
        covariance = np.linalg.inv(system + 1e-12 * np.trace(system) * np.eye(3))
        found = covariance @ (rows.T @ values)
        misfit = max((values @ values - found @ (rows.T @ values)) / (len(values) - 3), 1.0)
        radius = np.sqrt(found[2] + found[:2] @ found[:2])
        slope = np.append(2 * found[:2], 1) / (2 * radius)
        radii.append(radius)
        errors.append(np.sqrt(slope @ covariance @ slope) * misfit)
    return np.array(radii), np.array(errors)


def fit(centre, normal, radius, tilt, weight, roll, errors, iterations, start, limits):
    """Parameters, covariance and scatter of a patch."""
    (scale_error, spacing_error), reach = errors, radius.mean()
    height_floor, angle_floor, longest, sharpest, huber = limits
    scale = (0.4 * reach) ** np.array([0.0, 1, 1, *[2] * 3, *[3] * 4, *[4] * 5, 0])
    theta, error = _start(centre, normal, radius, weight), np.array([1e-2 * reach, 1e-2])
    if start is not None:
        theta, error = start
    foot = centre[:, :2] - radius[:, None] * normal[:, :2]
    design, residual = np.zeros((len(weight), 3, 16)), np.zeros((len(weight), 3))
    robust = np.repeat(weight[:, None], 2, axis=1)
    for step in range(iterations):
        linearise(theta, centre, normal, radius, tilt, foot, design, residual, 8 if step == 0 else 2)
        k = np.clip(np.abs(theta[[3, 5]]).max(), 3.0, sharpest)
        prior = [0, 1, 1, *[1e-6] * 3, *[k**-4] * 4, *[(3 * k**3) ** -2] * 5, scale_error**-2] / scale**2
        covariance, change, used = least_squares(design, residual, robust, error, scale, prior, theta)
        change = change * min(1.0, longest / (reach * np.abs(change[3:6] / scale[3:6]).max()))
        theta = theta + change / scale
        own, chain, robust, joints = scatter(
            residual - design / scale @ change, used, robust, weight, roll, huber
        )
        own = own * np.sqrt((1 + chain) / (1 - chain))
        own[1] = max(own[1], spacing_error)
        shared = np.sqrt((len(weight) - 1) / (len(weight) - joints))
        before, error = error, np.hypot(own, [height_floor * reach * shared, angle_floor])
        settled = np.abs(change[3:6]).max() < 0.02 * np.sqrt(np.diag(covariance)[3:6]).min()
        if step > 2 and settled and np.abs(np.log(error / before)).max() < 0.02:
            break
    return theta, covariance / np.outer(scale, scale), error


def scatter(left, used, weight, block_weight, roll, huber):
    """Scatter of heights and normals, how neighbours go together, robust weights, and joints."""
    square = np.stack([left[:, 0] ** 2, (left[:, 1:] ** 2).sum(axis=1)], axis=1)
    free = np.array([1, 2]) * weight.sum(axis=0) - used
    own = np.sqrt((weight * square).sum(axis=0) / np.maximum(free, 1.0)) + 1e-12
    joined = roll[1:] == roll[:-1]
    products = (left[1:] * left[:-1])[joined]
    product = np.array([products[:, 0].sum(), products[:, 1:].sum()]) / square.sum(axis=0)
    size = np.sqrt(square / [1, 2]) / own
    robust = block_weight[:, None] * np.minimum(1.0, huber / size)
    return own, np.clip(product, 0.0, 0.8), robust, joined.sum()


def _start(centre, normal, radius, weight):
    """First guess: the surface of the centres, from their heights or from the normals over them."""
    root, (x, y, z), reach = np.sqrt(weight)[:, None], centre.T, radius.mean()
    flat = np.stack([np.ones_like(x), x, y], axis=1) * root
    ridge = len(root) * (0.01 * reach) ** 2 * np.diag([1e-9, 1.0, 1.0])
    target = -normal[:, :2] * root
    linear = np.linalg.solve(flat.T @ flat + ridge, flat.T @ target)
    slope, offset = linear[0], 0.5 * (linear[1:] + linear[1:].T)
    square = 0.5 * np.stack([x * x, 2 * x * y, y * y], axis=1) * root
    rows = np.concatenate([flat, square], axis=1) / reach ** np.array([0.0, 1, 1, 2, 2, 2])
    ridge = 1e-5 * len(root) * np.diag([0.0, 1, 1, 1, 1, 1])
    bent = np.linalg.solve(rows.T @ rows + ridge, rows.T @ (z * root[:, 0]))
    apart = np.sqrt(np.average(x * x + y * y, weights=weight))
    if 4 / apart * np.std(z * root[:, 0] - rows @ bent) < np.std(target - flat @ linear):
        slope, offset = bent[1:3] / reach, bent[[[3, 4], [4, 5]]] / reach**2
    values, axes = np.linalg.eigh(offset)
    k = np.maximum(values / np.maximum(1 + reach * values, 0.05), -5 / reach)
    below = axes @ np.diag(k) @ axes.T
    steep = slope + centre[:, :2] @ offset
    upright = np.concatenate([-steep, np.ones((len(steep), 1))], axis=1)
    contact = centre - radius[:, None] * upright / np.linalg.norm(upright, axis=1, keepdims=True)
    flat = contact[:, :2]
    rise = flat @ slope + 0.5 * np.einsum("bi,ij,bj->b", flat, below, flat)
    theta = np.zeros(16)
    theta[:6] = (
        np.average(contact[:, 2] - rise, weights=weight),
        *slope,
        below[0, 0],
        below[0, 1],
        below[1, 1],
    )
    return theta


def off_the_arc(way, before, after, share):
    """A quantile of the distances of a way from the arc that the normals before and after ask for."""
    chord = way[-1] - way[0]
    length = np.linalg.norm(chord)
    ahead, outward = chord / length, before + after
    outward = outward - (outward @ ahead) * ahead
    outward = outward / np.linalg.norm(outward)
    part = np.clip((way - way[0]) @ ahead / length, 0.0, 1.0)
    sine = np.clip((after - before) @ ahead / 2, -0.99, 0.99)
    radius = 0.5 * length / max(abs(sine), 1e-6)
    deep = np.sqrt(radius**2 - np.square((part - 0.5) * length)) - radius * np.sqrt(1 - sine**2)
    arc = way[0] + part[:, None] * chord + (np.sign(sine) * deep)[:, None] * outward
    return np.sort(np.linalg.norm(way - arc, axis=1))[int(share * (len(way) - 1))]


def rings(positions, contact, pressure, count, furthest):
    """Taxels at equal steps from contacts: number, sums of pressures and squared distances."""
    apart = np.linalg.norm(positions - contact[:, None], axis=2)
    ring = (apart * (count / furthest)).astype(int)
    return [[own[ring == r].sum() for r in range(count)] for own in (np.ones_like(apart), pressure, apart**2)]


def blend(points, surface):
    """Values and gradients of a blended surface."""
    weight = np.exp(-np.square(points[:, None] - surface.positions_m).sum(axis=2) / (2 * surface.width_m**2))
    weight /= weight.sum(axis=1, keepdims=True)
    away = points[:, None] - surface.positions_m
    bent = np.einsum("nij,mnj->mni", surface.tensors_per_m, away)
    own = surface.heights_m + np.einsum("mni,mni->mn", away, surface.normals + 0.5 * bent)
    value = np.sum(weight * own, axis=1)
    spread = -(weight * (own - value[:, None]))[:, :, None] * away / surface.width_m**2
    return value, np.sum(weight[:, :, None] * (surface.normals + bent) + spread, axis=1)


def primitive_shares(nodes, deviation, axes, slope, centre, left, gamma, below):
    """Probabilities of P, C-, C+, H, E- and E+; the distribution function of a normal is given."""
    steps = nodes * deviation
    d, e = (centre[1:] + steps @ axes.T).T
    h, r = centre[0] + steps @ slope, np.hypot(d, e)
    first, second, third, mirrored = (
        below((limit - h) / left) for limit in (-gamma - r, np.abs(gamma - r), gamma + r, -np.abs(gamma - r))
    )
    middle, curved = second - mirrored, r > gamma
    shares = (middle * ~curved, mirrored - first, third - second, middle * curved, first, 1 - third)
    return [share.mean() for share in shares]
