"""Compile single MJCF files, and check them with rules that apply to all MJCF files."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.model_files import ModelFile
from mjsim.house.compiled.footprint import geom_name, outline_points
from mjsim.house.validation.findings import Finding
from mjsim.values.errors import AssetError

MAX_NUMBER = 1e6  # largest number that is plausible in an MJCF file
LOOK_GROUPS, SOLID_GROUPS = (0, 1, 2), (0, 3)
_TEXT = ("name", "file", "class", "childclass", "material", "mesh", "texture", "model")
_KIND = {
    "nu": "actuators",
    "ntendon": "tendons",
    "neq": "equality constraints",
    "nkey": "keyframes",
    "nflex": "flexible bodies",
    "nskin": "skins",
    "nhfield": "height fields",
    "npair": "contact pairs",
    "nplugin": "plugins",
    "nmocap": "mocap bodies",
}


@dataclass(frozen=True, eq=False)
class Compiled:
    """A compiled model together with its initial state."""

    subject: str  # name of the model in findings, such as `object mug`
    path: Path
    model: mujoco.MjModel
    data: mujoco.MjData  # initial state, including the poses of bodies, geoms and sites

    @classmethod
    def of(cls, subject: str, path: Path, model: mujoco.MjModel) -> "Compiled":
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        return cls(subject, path, model, data)

    @cached_property
    def solid(self) -> NDArray[np.intp]:
        """The ids of all geoms that collide, shape (k,)."""
        return np.flatnonzero(self.model.geom_contype | self.model.geom_conaffinity)

    @cached_property
    def shown(self) -> NDArray[np.intp]:
        """The ids of all geoms that are visible, shape (k,)."""
        seen = np.isin(self.model.geom_group, LOOK_GROUPS) & (self.model.geom_rgba[:, 3] > 0)
        return np.flatnonzero(seen)

    def points(self, geom: int) -> NDArray[np.float64]:
        """Return points (k, 3), in metres, that enclose a geom seen from above and have its height range."""
        rotation = self.data.geom_xmat[geom].reshape(3, 3)
        return outline_points(self.model, geom, self.data.geom_xpos[geom], rotation)

    def extent(self, geoms: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return the lower and the upper corner of the bounding box of geoms, in metres, shape (2, 3)."""
        points = np.concatenate([self.points(int(g)) for g in geoms])
        return np.array([points.min(axis=0), points.max(axis=0)])

    def geom_name(self, geom: int) -> str:
        return geom_name(self.model, geom)

    def site(self, name: str) -> int | None:
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, name)
        return None if found < 0 else int(found)

    def error(self, rule: str, message: str, remedy: str, place: object = None) -> Finding:
        """Create an error finding about this model. `place` is its position (x, y, z) in metres."""
        return Finding(rule, self.subject, message, remedy, "error", self.path.name, _place(place))

    def warning(self, rule: str, message: str, remedy: str, place: object = None) -> Finding:
        return Finding(rule, self.subject, message, remedy, "warning", self.path.name, _place(place))


def compile_model(subject: str, path: Path) -> Compiled | list[Finding]:
    """Compile a single MJCF file. If it does not compile, return findings instead of a model."""
    try:
        file = ModelFile.read(path)
        # Check numbers first, because MuJoCo would treat NaN as a missing number and write a log file.
        if found := list(check_numbers(subject, file)):
            return found
        return Compiled.of(subject, path, file.spec().compile())
    except OSError as error:
        message, remedy = f"{path} cannot be read: {error.strerror}", "correct the path"
    except AssetError as error:
        message, _, remedy = str(error).rpartition("; ")
    except UnicodeDecodeError as error:
        message, remedy = f"is not UTF-8 at byte {error.start}", "save it as UTF-8"
    except (ValueError, mujoco.FatalError) as error:
        message, remedy = f"does not compile: {' '.join(str(error).split())}", "correct that element"
    return [Finding("file", subject, message, remedy, file=path.name)]


def check_numbers(subject: str, model: ModelFile) -> Iterator[Finding]:
    """Find numbers in an MJCF file that are not finite or that are implausibly large."""
    for element in model.elements:
        for name, value in element.items():
            if name in _TEXT or element.tag in ("include", "text"):
                continue
            if bad := next((w for w in value.split() if _is_bad_number(w)), None):
                label = element.get("name", "")
                yield Finding(
                    "finite",
                    subject,
                    f"<{element.tag} {label}> has {name}={bad}",
                    "give a finite number in metres, kilograms, seconds or radians",
                    file=model.path.name,
                )


def check_still(compiled: Compiled) -> Iterator[Finding]:
    """Check that a model has no joints, and consists only of bodies, geoms, sites and assets."""
    model = compiled.model
    for joint in range(model.njnt):
        body = model.body(int(model.jnt_bodyid[joint])).name
        name = model.joint(joint).name or f"#{joint}"
        yield compiled.error(
            "joints",
            f"joint {name!r} of body {body!r} lets it move",
            "remove the joint: doors and drawers stand still, and objects get their free joint in the scene",
            compiled.data.xpos[model.jnt_bodyid[joint]],
        )
    for field, kind in _KIND.items():
        if count := int(getattr(model, field, 0)):
            yield compiled.error("contents", f"has {count} {kind}", "remove them")
    floating = np.flatnonzero(model.body_gravcomp)
    if len(floating):
        name = model.body(int(floating[0])).name
        yield compiled.error("contents", f"body {name!r} has gravcomp, which cancels its weight", "remove it")


def check_groups(compiled: Compiled) -> Iterator[Finding]:
    """Check that geoms in groups 0 and 3 collide, and that geoms in groups 1 and 2 do not collide."""
    model = compiled.model
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    solid_remedy = 'use group 0 (seen) or 3 (not seen), or make it visual: contype="0" conaffinity="0"'
    seen_remedy = "use group 2 for what is only seen (1 for ceilings and lamps), or let it collide"
    for chosen, groups, what, remedy in (
        (collides, SOLID_GROUPS, "collides", solid_remedy),
        (~collides, (1, 2), "does not collide", seen_remedy),
    ):
        for geom in np.flatnonzero(chosen & ~np.isin(model.geom_group, groups)):
            name, place = compiled.geom_name(int(geom)), compiled.data.geom_xpos[geom]
            message = f"geom {name} {what} but is in group {model.geom_group[geom]}"
            yield compiled.error("groups", message, remedy, place)


def check_contact_bits(compiled: Compiled) -> Iterator[Finding]:
    """Check that colliding geoms set MuJoCo's default contact bit. Others pass through each other."""
    model = compiled.model
    for geom in compiled.solid:
        contype, conaffinity = int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])
        if not (contype & 1 and conaffinity & 1):
            yield compiled.error(
                "contact",
                f'geom {compiled.geom_name(int(geom))} has contype="{contype}" conaffinity="{conaffinity}"',
                'leave both out (1 and 1), or set both to "0" for what is only seen',
                compiled.data.geom_xpos[geom],
            )


def _is_bad_number(word: str) -> bool:
    try:
        value = float(word)
    except ValueError:
        return False
    return not math.isfinite(value) or abs(value) > MAX_NUMBER


def _place(place: object) -> tuple[float, ...] | None:
    if place is None:
        return None
    values = np.asarray(place, dtype=np.float64)
    return tuple(values.tolist()) if np.isfinite(values).all() else None
