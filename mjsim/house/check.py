"""The checks that the `mjsim check` command runs on houses, receptacles, objects and episodes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import CATALOGUE
from mjsim.house.catalogue.model_files import elements
from mjsim.house.compiled.house import CompiledHouse, compiled_house
from mjsim.house.compiled.standing import StandingPlaces
from mjsim.house.scene.episode_rules import check_fit, check_overlaps, check_poses, check_reach
from mjsim.house.scene.sampling import points_that_fit, sample_episode
from mjsim.house.scene.scene import assemble
from mjsim.house.validation.checked_model import Compiled, compile_model
from mjsim.house.validation.drawn import coplanar_faces, describe, overlaps
from mjsim.house.validation.findings import Finding, errors
from mjsim.house.validation.object_rules import check_compiled_object
from mjsim.house.validation.receptacle_rules import check_compiled_receptacle
from mjsim.house.validation.validate import check_house, require_usable
from mjsim.house.validation.views import Drawing, floor_view, side_views
from mjsim.values.episode import POINTS, Episode
from mjsim.values.errors import AssetError, EpisodeError, PhysicsError, SamplingError
from mjsim.values.person_parameters import PersonParameters


@dataclass(frozen=True, eq=False)
class CheckReport:
    """The result of checking a house, a receptacle, an object or an episode."""

    kind: str  # what was checked: `house`, `receptacle`, `object` or `episode`
    path: str  # name or path that was checked
    findings: tuple[Finding, ...]  # problems that were found, errors first
    facts: Mapping[str, str] = field(default_factory=dict)  # other facts to show in the report: name -> text
    views: tuple[Drawing, ...] = ()  # drawings of the model, or empty if it does not compile

    def __post_init__(self) -> None:
        ordered = sorted(self.findings, key=lambda f: f.severity != "error")
        object.__setattr__(self, "findings", tuple(ordered))

    @property
    def usable(self) -> bool:
        return not errors(self.findings)


Load = Callable[[str], Catalogue]


def check_path(name: str, house: str | None = None, load: Load = Catalogue.load) -> CheckReport:
    """Check a house, an MJCF file or an episode. A house may be given by its name, folder or catalogue.

    Args:
        name: Name or path to check.
        house: Name of the house to check an episode against. The default is the episode's own house.
        load: Function that loads a house by its name. `mjsim.load_catalogue` also supports generated houses.
    """
    path = Path(name)
    if path.suffix == ".json":
        return check_episode_file(path, house, load)
    if path.suffix == ".xml":
        return _check_model(path, load)
    if path.is_dir() and not (path / CATALOGUE).is_file():
        raise AssetError(f"no {CATALOGUE} in {path}; give a house's folder, or one of its files")
    return check_house_name(str(path / CATALOGUE) if path.is_dir() else name, load)


def check_house_name(name: str, load: Load = Catalogue.load) -> CheckReport:
    """Check a house with its receptacles and objects, and check that an episode can be sampled in it."""
    try:
        catalogue = load(name)
    except AssetError as error:
        return CheckReport("house", name, (_unreadable("catalogue", error),))
    house = compiled_house(catalogue)
    found = house.cached("findings", lambda: check_house(house))
    if errors(found):
        return CheckReport("house", name, tuple(found), views=_partial_view(catalogue))
    fits, more = _check_sampling(house)
    xmin, ymin, xmax, ymax = house.rooms.bounds
    facts = {
        "size": f"{xmax - xmin:.1f} x {ymax - ymin:.1f} m",
        "rooms": str(len(catalogue.rooms)),
        "receptacles": str(len(catalogue.receptacles)),
        "object models": str(len(catalogue.objects)),
        "floor": f"{house.rooms.area:.1f} m2",
        "points that fit": f"{fits}{' or more' if fits == (catalogue.points or POINTS) else ''}",
    }
    compiled = Compiled.of("house", catalogue.house_path, house.model)
    facts["drawn overlaps"] = describe(compiled, overlaps(compiled), 1000, "mm deep")
    facts["flickering faces"] = describe(compiled, coplanar_faces(compiled), 10_000, "cm2")
    view = floor_view(compiled, house.rooms, house.receptacles)
    return CheckReport("house", name, (*found, *more), facts, (view,))


def _check_sampling(house: CompiledHouse) -> tuple[int, list[Finding]]:
    meant = house.catalogue.points or POINTS
    fits = points_that_fit(house, house.navigable, meant)
    found = []
    if fits < meant:
        found.append(
            Finding(
                "points",
                "house",
                f"{fits} of {meant} points fit at least 1 m from each other and from the receptacles",
                f"sample it with --points {max(fits - 2, 1)}, or enlarge it",
                "warning" if fits else "error",
            )
        )
    if fits:
        pool = max(1, fits - 2 if fits < meant else fits)
        objects = min(pool, len(house.catalogue.objects))
        try:
            sample_episode(house.catalogue, house.navigable, objects=objects, seed=0, points=pool)
        except (SamplingError, PhysicsError) as error:
            found.append(
                Finding(
                    "sampling", "house", f"{objects} objects cannot be dropped: {error}", "see the message"
                )
            )
    return fits, found


def check_episode_file(path: Path, house: str | None = None, load: Load = Catalogue.load) -> CheckReport:
    """Check whether an episode is valid in its own house, or in the house with the name `house`."""
    try:
        episode = Episode.load(path)
    except EpisodeError as error:
        return CheckReport("episode", str(path), (_unreadable("episode", error),))
    try:
        catalogue = load(house or episode.house)
        built = compiled_house(catalogue)
        require_usable(built)
    except AssetError as error:
        return CheckReport("episode", str(path), (_unreadable("house", error),))
    found = [*check_fit(episode, catalogue), *check_poses(episode, built.rooms)]
    compiled = Compiled.of("house", catalogue.house_path, built.model)
    view = floor_view(compiled, built.rooms, built.receptacles, episode)
    if not errors(found):
        scene = assemble(episode, catalogue)
        found += check_overlaps(episode, scene.model, scene.index.geom_owner)
        found += check_reach(episode, StandingPlaces.of(built, built.navigable, PersonParameters()))
    facts = {"house": catalogue.name, "objects": str(len(episode.objects)), "seed": str(episode.seed)}
    return CheckReport("episode", str(path), tuple(found), facts, (view,))


def _check_model(path: Path, load: Load) -> CheckReport:
    if not path.is_file():
        raise AssetError(f"no file {path}; give a {CATALOGUE}, an object's .xml or an episode's .json")
    bodies = {e.get("name") for e in elements(path) if e.tag == "body"}
    if "receptacle" in bodies:
        kind, rules = "receptacle", check_compiled_receptacle
    elif "object" in bodies or not path.with_name(CATALOGUE).is_file():
        kind, rules = "object", check_compiled_object
    else:
        return check_house_name(str(path.with_name(CATALOGUE)), load)
    compiled = compile_model(f"{kind} {path.stem}", path)
    if not isinstance(compiled, Compiled):
        return CheckReport(kind, str(path), tuple(compiled))
    findings = rules(compiled)
    if not len(compiled.solid):
        return CheckReport(kind, str(path), tuple(findings))
    size = np.ptp(compiled.extent(compiled.solid), axis=0)
    facts = {
        "size": " x ".join(f"{s:.3f}" for s in size) + " m",
        "mass": f"{compiled.model.body_mass.sum():.3g} kg",
        "parts": f"{len(compiled.solid)} collide, {len(compiled.shown)} are seen",
    }
    return CheckReport(kind, str(path), tuple(findings), facts, side_views(compiled))


def _partial_view(catalogue: Catalogue) -> tuple[Drawing, ...]:
    compiled = compile_model("house", catalogue.house_path)
    return (floor_view(compiled),) if isinstance(compiled, Compiled) else ()


def _unreadable(subject: str, error: Exception) -> Finding:
    message, _, remedy = " ".join(str(error).split()).rpartition("; ")
    return Finding("file", subject, message or remedy, remedy if message else "correct the file")
