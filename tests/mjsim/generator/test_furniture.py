import mujoco
import numpy as np
import pytest
from houses_cases import PALETTE, compiled

from mjsim.generator.furniture.appearance import Appearance, draw_appearance
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.piece import Piece

SLACK = 0.03  # m


@pytest.fixture(scope="module")
def look() -> Appearance:
    return draw_appearance(PALETTE, np.random.default_rng(0))


@pytest.fixture(scope="module", params=sorted(KINDS))
def pieces(request: pytest.FixtureRequest, look: Appearance) -> list[tuple[Piece, mujoco.MjModel]]:
    """Pieces of one kind, large and small, each with its model."""
    made = [make(request.param, look, seed, smaller=seed % 3) for seed in range(4)]
    return [(piece, compiled(piece, look)) for piece in made]


def make(kind: str, look: Appearance, seed: int, smaller: int = 0) -> Piece:
    return KINDS[kind].make(np.random.default_rng(seed), look, smaller=smaller)


def extents(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners of all geoms that are no shadows, each (k, 3), and which collide."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    low, high = [], []
    for geom in range(model.ngeom):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        axes = data.geom_xmat[geom].reshape(3, 3)
        middle = data.geom_xpos[geom] + axes @ model.geom_aabb[geom, :3]
        reach = np.abs(axes) @ model.geom_aabb[geom, 3:]
        low.append(middle - reach)
        high.append(middle + reach)
    return np.array(low), np.array(high)


def test_there_are_sixty_kinds() -> None:
    assert len(KINDS) >= 60


def test_a_piece_compiles_and_stays_within_its_size(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    for piece, model in pieces:
        low, high = extents(model)
        w, d, h = piece.size
        assert low[:, 2].min() > -0.01
        assert low[:, 0].min() > -w / 2 - SLACK and high[:, 0].max() < w / 2 + SLACK
        if piece.stands != "ceiling":
            assert (
                low[:, 1].min() > (-0.08 if piece.stands == "recess" else -SLACK)
                and high[:, 1].max() < d + SLACK
            )
        assert high[:, 2].max() < max(h, 2.6 if "dining" in piece.kind else 0) + SLACK
        for part in piece.parts:
            x0, y0, x1, y1 = part.spot
            assert -w / 2 - 1e-6 <= x0 < x1 <= w / 2 + 1e-6 and -1e-6 <= y0 < y1 <= d + 1e-6


def test_what_collides_is_within_the_parts(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    """Ways are looked for around the parts: nothing that stands in a way may be outside of them."""
    for piece, model in pieces:
        low, high = extents(model)
        solid = [g for g in range(model.ngeom) if model.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE]
        for k, geom in enumerate(solid):
            if not model.geom_contype[geom] or low[k, 2] > 1.8 or high[k, 2] < 0.05:
                continue
            boxes = [np.array(part.hit) for part in piece.parts]
            assert (
                any(
                    (low[k, :2] >= box[:2] - 0.025).all() and (high[k, :2] <= box[2:] + 0.025).all()
                    for box in boxes
                )
                or len(boxes) > 1
            ), (low[k], high[k])


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_a_seed_gives_the_same_piece_and_another_seed_another(kind: str, look: Appearance) -> None:
    pieces = [make(kind, look, seed) for seed in (1, 1, 2, 3, 4, 5, 6)]
    assert pieces[0] == pieces[1]
    assert len({repr(piece) for piece in pieces[1:]}) >= 3
