"""Every catalogue entry gets a picture that is framed, cut out and lit."""

import numpy as np
import pytest

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.render import render_picture, render_pictures
from mjsim.values.errors import AssetError, RenderError

RED_BALL = """<mujoco><worldbody><body name="object">
  <geom type="sphere" size="{size}" pos="{x} 0 0.1" rgba="1 0 0 1"/>
  <geom type="box" size="3 3 3" rgba="0 0 1 1" group="3"/>
</body></worldbody></mujoco>"""


def write(path, text):
    path.write_text(text)
    return path


def spans(alpha):
    rows, columns = np.flatnonzero(alpha.any(axis=1)), np.flatnonzero(alpha.any(axis=0))
    return rows[0], rows[-1], columns[0], columns[-1]


@pytest.fixture(scope="module")
def pictures():
    return render_pictures(Catalogue.load(), size=48)


def test_there_is_one_picture_per_object_and_receptacle(pictures):
    catalogue = Catalogue.load()
    keys = {f"object:{k}" for k in catalogue.objects} | {f"receptacle:{k}" for k in catalogue.receptacles}
    assert pictures.keys() == keys
    assert {(p.shape, p.dtype) for p in pictures.values()} == {((48, 48, 4), np.dtype(np.uint8))}


def test_pictures_fill_the_frame_without_touching_its_edge(pictures):
    for key, picture in pictures.items():
        top, bottom, left, right = spans(picture[..., 3])
        assert 40 <= max(bottom - top, right - left) + 1 <= 47, key
        assert min(top, left) >= 1 and max(bottom, right) <= 46, key
        assert abs((top + bottom) - 47) <= 2 and abs((left + right) - 47) <= 2, key


def test_pictures_differ_and_are_neither_black_nor_burnt_out(pictures):
    assert len({p.tobytes() for p in pictures.values()}) == len(pictures)
    for key, picture in pictures.items():
        solid = picture[picture[..., 3] == 255][:, :3].astype(float)
        assert 30 < solid.mean() < 240, key
        assert solid.std() > 5, key


def test_framing_does_not_depend_on_size_or_place(tmp_path):
    small = render_picture(write(tmp_path / "a.xml", RED_BALL.format(size=0.03, x=0)))
    large = render_picture(write(tmp_path / "b.xml", RED_BALL.format(size=0.3, x=0.7)))
    assert np.abs(small[..., 3].astype(int) - large[..., 3]).mean() < 2
    filled = np.pi / 4 * 0.92**2
    assert small[..., 3].mean() / 255 == pytest.approx(filled, rel=0.03)


def test_edges_carry_no_background_and_hidden_groups_no_colour(tmp_path):
    picture = render_picture(write(tmp_path / "a.xml", RED_BALL.format(size=0.03, x=0)), size=64)
    edge = (picture[..., 3] > 30) & (picture[..., 3] < 225)
    assert edge.sum() > 30
    assert picture[edge][:, 0].min() > 80  # black bleeding in would darken thin coverage
    assert picture[..., 1:3].max() < 30


def test_light_comes_from_the_upper_left(tmp_path):
    picture = render_picture(write(tmp_path / "a.xml", RED_BALL.format(size=0.03, x=0)), size=64).astype(
        float
    )
    assert picture[16:24, 16:24, 0].mean() > picture[40:48, 40:48, 0].mean() + 30


def test_unusable_models_are_named(tmp_path):
    with pytest.raises(AssetError, match=r"bad\.xml"):
        render_picture(write(tmp_path / "bad.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>"))
    clear = '<mujoco><worldbody><geom size=".1" rgba="1 1 1 0"/></worldbody></mujoco>'
    with pytest.raises(RenderError, match=r"clear\.xml shows nothing"):
        render_picture(write(tmp_path / "clear.xml", clear))
    with pytest.raises(RenderError, match="picture sides"):
        render_picture(write(tmp_path / "ok.xml", RED_BALL.format(size=0.03, x=0)), size=0)
