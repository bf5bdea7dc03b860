"""Conditions under which an object can be picked up or placed, such as reach, sight and a free hand."""

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from mjsim.house.compiled.rays import receptacle_in_sight, sees
from mjsim.house.scene import avatar
from mjsim.values.actions import ActionResult, Pick, Place, Refusal
from mjsim.values.observation import ObjectStatus
from mjsim.world.body.person import Person

_CHEST = 0.75  # height of the chest as a fraction of the eye height


def resolve_pick(person: Person, action: Pick, status: Sequence[ObjectStatus], *, busy: bool) -> ActionResult:
    names = person.scene.index.names
    if busy:
        return ActionResult(action, Refusal.BUSY, action.object)
    if action.object is not None and action.object not in names:
        return ActionResult(action, Refusal.UNKNOWN_OBJECT, action.object)
    if action.object is None:
        return _pick_nearest(person, action, status)
    item = names.index(action.object)
    target = person.scene.episode.targets[action.object]
    answer = ActionResult(action, None, action.object, target)
    if status[item] is ObjectStatus.CARRIED:
        return replace(answer, refusal=Refusal.ALREADY_CARRIED)
    if status[item] is ObjectStatus.DELIVERED:
        return replace(answer, refusal=Refusal.ALREADY_DELIVERED)
    if not person.free_hands:
        return replace(answer, refusal=Refusal.HANDS_FULL)
    if _object_distances(person, [item])[0] > person.parameters.reach or not _object_in_sight(person, item):
        return replace(answer, refusal=Refusal.OUT_OF_REACH)
    return answer


def _pick_nearest(person: Person, action: Pick, status: Sequence[ObjectStatus]) -> ActionResult:
    if not person.free_hands:
        return ActionResult(action, Refusal.HANDS_FULL)
    loose = [i for i, s in enumerate(status) if s is ObjectStatus.LOOSE]
    distances = _object_distances(person, loose)
    for distance, item in sorted(zip(distances, loose, strict=True)):
        if distance > person.parameters.reach:
            break
        if _object_in_sight(person, item):
            name = person.scene.index.names[item]
            return ActionResult(action, None, name, person.scene.episode.targets[name])
    return ActionResult(action, Refusal.NOTHING_IN_REACH)


def resolve_place(person: Person, action: Place, *, busy: bool) -> ActionResult:
    scene = person.scene
    if busy:
        return ActionResult(action, Refusal.BUSY, action.object)
    if action.object is not None and action.object not in scene.index.names:
        return ActionResult(action, Refusal.UNKNOWN_OBJECT, action.object)
    if not person.carried:
        return ActionResult(action, Refusal.HANDS_EMPTY, action.object)
    if action.object is not None and action.object not in person.carried:
        return ActionResult(action, Refusal.NOT_CARRIED, action.object)
    choices = person.carried if action.object is None else (action.object,)
    targets = scene.episode.targets
    reachable = reachable_receptacles(person)
    name = min(choices, key=lambda n: (targets[n] not in reachable, _distance(person, targets[n])))
    if targets[name] in reachable:
        return ActionResult(action, None, name, targets[name])
    if reachable:
        nearest = min(reachable, key=lambda key: _distance(person, key))
        return ActionResult(action, Refusal.NOT_THE_RECEPTACLE, name, nearest)
    return ActionResult(action, Refusal.RECEPTACLE_OUT_OF_REACH, name, targets[name])


def reachable_receptacles(person: Person) -> tuple[str, ...]:
    """Return the keys of all receptacles that are within reach and in sight, in the episode's order."""
    near = (k for k in person.scene.receptacles if _distance(person, k) <= person.parameters.reach)
    return tuple(k for k in near if _receptacle_in_sight(person, k))


def _distance(person: Person, key: str) -> float:
    return person.scene.receptacles[key].distance(person.rig.position)


def _object_distances(person: Person, items: list[int]) -> list[float]:
    offsets = person.data.xipos[person.scene.index.bodies[items], :2] - person.rig.position
    return cast(list[float], np.hypot(offsets[:, 0], offsets[:, 1]).tolist())


def _object_in_sight(person: Person, item: int) -> bool:
    """Return True if an object is visible from the eye or chest. This prevents picks through walls."""
    viewpoints = person.rig.eye, np.array([*person.rig.position, _CHEST * person.parameters.eye_height])
    points = [person.center(item), *(person.grips.point(item, grip) for grip in avatar.GRIPS)]
    model, data = person.scene.model, person.data
    return any(sees(model, data, eye, point) for eye in viewpoints for point in points)


def _receptacle_in_sight(person: Person, key: str) -> bool:
    eye = np.array([*person.rig.position, person.parameters.eye_height])
    return receptacle_in_sight(person.scene.model, person.data, eye, person.scene.receptacles[key])
