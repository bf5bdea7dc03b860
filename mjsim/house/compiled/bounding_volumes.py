"""Optimize the bounding volume hierarchy of a compiled house for faster collision detection and ray casts.

MuJoCo's compiler recursively splits the sorted geoms of a body in half. In a house, this groups table legs
with walls and floors, so boxes overlap. This module rebuilds the tree over the same leaves with the surface
area heuristic (MacDonald and Booth, 1990). This halves the box tests, and contacts stay the same.
"""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

_MIN_LEAVES = 16


def tighten(model: mujoco.MjModel) -> None:
    """Rebuild the bounding volume hierarchies of a model's static bodies in place."""
    for body in np.flatnonzero(model.body_weldid == 0).tolist():
        first, count = int(model.body_bvhadr[body]), int(model.body_bvhnum[body])
        if count < 2 * _MIN_LEAVES:
            continue
        nodes = slice(first, first + count)
        leaves = first + np.flatnonzero(model.bvh_nodeid[nodes] >= 0)
        boxes, geoms = model.bvh_aabb[leaves], model.bvh_nodeid[leaves]
        made, children, leaf, depth = surface_area_tree(
            boxes[:, :3] - boxes[:, 3:], boxes[:, :3] + boxes[:, 3:]
        )
        if len(made) != count:  # Skip hierarchies that are not binary trees with one geom per leaf.
            continue
        inner = leaf < 0
        model.bvh_aabb[nodes] = made
        model.bvh_aabb[nodes][~inner] = boxes[leaf[~inner]]
        model.bvh_child[nodes] = children
        model.bvh_nodeid[nodes] = np.where(inner, -1, geoms[leaf])
        model.bvh_depth[nodes] = depth


@kernel
def surface_area_tree(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Build a binary tree of bounding boxes over n boxes with corners (n, 3), by the surface area heuristic.

    Returns arrays for the 2n - 1 nodes, of which node 0 is the root: the box as centre and half size, the two
    children or -1, the index of a leaf's box or -1, and the depth.
    """
    count = len(low)
    total = 2 * count - 1
    boxes = np.empty((total, 6))
    children = np.full((total, 2), -1, np.int32)
    leaf = np.full(total, -1, np.int32)
    depth = np.zeros(total, np.int32)
    order = np.arange(count)
    begins, ends = np.zeros(total, np.int64), np.zeros(total, np.int64)
    ends[0] = count
    made = 1
    for node in range(total):
        begin, end = begins[node], ends[node]
        for axis in range(3):
            lowest, highest = math.inf, -math.inf
            for k in range(begin, end):
                lowest = min(lowest, low[order[k], axis])
                highest = max(highest, high[order[k], axis])
            boxes[node, axis] = 0.5 * (lowest + highest)
            boxes[node, 3 + axis] = 0.5 * (highest - lowest)
        if end - begin == 1:
            leaf[node] = order[begin]
            continue
        cut = _split(low, high, order, begin, end)
        for side in range(2):
            children[node, side] = made
            depth[made] = depth[node] + 1
            begins[made], ends[made] = (begin, cut) if side == 0 else (cut, end)
            made += 1
    return boxes, children, leaf, depth


@kernel
def _split(
    low: NDArray[np.float64], high: NDArray[np.float64], order: NDArray[np.int64], begin: int, end: int
) -> int:
    count = end - begin
    best, best_cut = math.inf, begin + count // 2
    members = order[begin:end].copy()
    after = np.empty(count)
    for axis in range(3):
        key = low[members, axis] + high[members, axis]
        ranked = members[np.argsort(key, kind="mergesort")]
        _areas(low, high, ranked[::-1], after)
        before = np.empty(count)
        _areas(low, high, ranked, before)
        for k in range(1, count):
            cost = k * before[k - 1] + (count - k) * after[count - k - 1]
            if cost < best:
                best, best_cut = cost, begin + k
                order[begin:end] = ranked
    return best_cut


@kernel
def _areas(
    low: NDArray[np.float64], high: NDArray[np.float64], ranked: NDArray[np.int64], areas: NDArray[np.float64]
) -> None:
    lx = ly = lz = math.inf
    hx = hy = hz = -math.inf
    for k in range(len(ranked)):
        b = ranked[k]
        lx, ly, lz = min(lx, low[b, 0]), min(ly, low[b, 1]), min(lz, low[b, 2])
        hx, hy, hz = max(hx, high[b, 0]), max(hy, high[b, 1]), max(hz, high[b, 2])
        x, y, z = hx - lx, hy - ly, hz - lz
        areas[k] = x * y + y * z + z * x
