#!/usr/bin/python3
"""The weights of the light grid's kernels against the best that any weights could do.

    tools/bench/fit_grid_kernels.py        needs python3-numpy; 15 s

A particle's kernel F(b²/r²) is put down on the nodes of a grid, and receivers find between them what bilinear
interpolation makes of it. For one kernel, wherever it stands in its cell, this prints the root mean square over the
plane of what they find less the kernel, relative to the kernel's own. Particles stand anywhere and independently, so
that the error of a cloud goes with it.

    cell     the grid's, in radii: the coarsest at which the window below has all weights
    nodes    along the edge of the window
    ours     KernelWeights of host/lighting/grid/plan.h: narrower, the margin left out
    F(q)     of the radius as it is, at all nodes that it covers: how many along the edge
    best     the least squares over all weights on `nodes` × `nodes` nodes
"""
import numpy as np

FINE = 8  # samples along a cell's edge
PLACES = (np.arange(6) + 0.5) / 6  # of the centre in its cell

# Falloff, ∫ F dq, and tentBelow, narrowing, leastSupport, margin.
FALLOFFS = {
    "smooth": (lambda q: np.maximum(1 - q, 0) ** 2, 1 / 3, 2.25, 0.73, 0.75, 0.72),
    "linear": (lambda q: np.maximum(1 - np.sqrt(q), 0), 1 / 3, 1.9, 0.65, 1.0, 0.0),
    "sphere": (lambda q: np.sqrt(np.maximum(1 - q, 0)), 2 / 3, 1.4, 0.4, 1.0, 0.0),
}


def tent(x):
    return np.maximum(1 - np.abs(x), 0)


def ours(falloff, radius):
    """The weights as a function of the distances in cells, squared; None: a tent."""
    shape, _, tent_below, narrowing, least, margin = FALLOFFS[falloff]
    if radius * radius <= tent_below:
        return None
    square = radius * radius - narrowing
    support = max(least, 1 - margin / np.sqrt(square))

    def weight(distance2):
        q = distance2 / square
        if support == 1:
            return shape(q)
        u = 1 - q
        return np.maximum(np.minimum(u * u, u / support - (1 / support - 1)), 0)

    return weight


def errors(falloff, radius, nodes):
    """Ours, F(q) and the best, for a kernel of a radius in cells; `nodes` of the window for the best."""
    shape, mass = FALLOFFS[falloff][:2]
    reach = int(np.ceil(max(radius, nodes / 2))) + 2
    node = np.arange(-reach, reach + 2)
    fine = (np.arange(-(reach + 2) * FINE, (reach + 3) * FINE) + 0.5) / FINE
    basis = tent(fine[:, None] - node[None, :])
    gram = basis.T @ basis
    own = ours(falloff, radius)
    left, whole = np.zeros(3), 0.0
    for y in PLACES:
        for x in PLACES:
            kernel = shape(((fine[None, :] - x) ** 2 + (fine[:, None] - y) ** 2) / radius**2)
            seen = basis.T @ kernel @ basis
            square = (kernel * kernel).sum()

            def remaining(weights):
                return (weights * (gram @ weights @ gram)).sum() - 2 * (weights * seen).sum() + square

            def total(weights):
                return weights * (np.pi * mass * radius**2 / weights.sum())

            across, along = node - x, node - y
            distance2 = across[None, :] ** 2 + along[:, None] ** 2
            put = tent(across)[None, :] * tent(along)[:, None] if own is None else own(distance2)
            left[0] += remaining(total(put))
            left[1] += remaining(total(shape(distance2 / radius**2)))
            near = np.abs(across) < nodes / 2, np.abs(along) < nodes / 2
            fitted = np.zeros_like(put)
            fitted[np.ix_(near[1], near[0])] = (
                np.linalg.inv(gram[np.ix_(near[1], near[1])])
                @ seen[np.ix_(near[1], near[0])]
                @ np.linalg.inv(gram[np.ix_(near[0], near[0])])
            )
            left[2] += remaining(fitted)
            whole += square
    return np.sqrt(left / whole)


def main():
    print(f"{'falloff':8} {'cell':>6} {'nodes':>6} {'ours':>8} {'F(q)':>14} {'best':>8}")
    for falloff, (_, _, tent_below, narrowing, least, margin) in FALLOFFS.items():
        for nodes in range(2, 13):
            # Half a window squared is least · s, or s − margin · √s, of the narrowed square s.
            whole = (margin / 2 + np.hypot(margin / 2, nodes / 2)) ** 2
            square = tent_below if nodes == 2 else min((nodes / 2) ** 2 / least, whole) + narrowing
            radius = np.sqrt(square) * (1 - 1e-6)
            found = errors(falloff, radius, nodes)
            plain = int(np.ceil(2 * radius))
            print(f"{falloff:8} {1 / radius:6.3f} {nodes:6} {found[0]:8.4f} {found[1]:8.4f} ({plain:2}) {found[2]:9.4f}")


if __name__ == "__main__":
    main()
