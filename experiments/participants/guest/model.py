"""The simulated participant `guest`, which combines all parts of the model."""

import math
from dataclasses import dataclass, replace

import numpy as np

from experiments.house import House
from experiments.participants.base import FullTurn, Guidance, Percept, Point
from experiments.participants.frontier import Frontier, SearchPlace
from experiments.participants.guest.decision import Chooser, Decision, Known, Timing
from experiments.participants.guest.deviations import Adherence, Compliance, Detours, Walking
from experiments.participants.guest.perception import Memory, Noticing, Perception, Recollection
from experiments.participants.visit_executor import VisitExecutor
from hud.markers import BREADCRUMB, FLAGPOLE
from mjsim.values.actions import IDLE, TIME_TOLERANCE, WAIT, Action, Wait
from mjsim.world.walking.polyline import path_length, project
from planner.plan import Visit, VisitKind

ARRIVED = 0.5  # distance at which a stop counts as reached, in metres
GONE = 1.2  # distance in metres within which a remembered object that is not in view counts as gone
SEEN_BIN = 2.0  # distance in metres within which the guest learns the location of a bin


@dataclass(frozen=True)
class Behaviour:
    """The parameter values of one guest."""

    perception: Perception
    memory: Memory
    decision: Decision
    compliance: Compliance
    walking: Walking
    timing: Timing


@dataclass(frozen=True)
class Intention:
    """The visit or search that a guest is about to make."""

    aim: Visit | SearchPlace  # visit to make, or viewpoint from which to search
    suggested: bool = False  # True if the HUD suggested the visit
    # True if the guest has left the shown path or was blocked on it
    strays: bool = False
    gives_up_at: float = math.inf  # simulated time in seconds at which the suggested step is given up


class Guest:
    """A simulated participant who has seen the house once. The guest works in every assistance condition."""

    needs: frozenset[str] = frozenset()

    def __init__(self, house: House, rng: np.random.Generator, behaviour: Behaviour) -> None:
        self._house, self._behaviour, self._rng = house, behaviour, rng
        self._executor = VisitExecutor(house)
        self._noticing = Noticing(behaviour.perception, rng)
        self._known = Recollection(behaviour.memory, house.receptacles, rng)
        self._frontier = Frontier(house, rng)
        self._chooser = Chooser(behaviour.decision, house, self._frontier, rng)
        self._adherence = Adherence(behaviour.compliance, rng)
        self._detours = Detours(behaviour.walking, house, rng)
        self._intention: Intention | None = None
        self._stops: list[Point] = []
        self._turn: FullTurn | None = None
        self._turned_for_poles = self._has_begun = False
        self._carried: set[str] = set()
        self._brought: set[str] = set()  # objects that are assumed to be in their bins
        self._passed: set[str] = set()  # objects that the guest has already considered picking up in passing
        self._room: str | None = None
        self._read: Visit | None = None
        self._given_up: Visit | None = None
        self._is_open = False  # True if the guest may still follow the last suggestion
        self._next_look = self._thinks_until = 0.0

    def act(self, percept: Percept) -> Action:
        if self._executor.waits(percept):
            return WAIT
        self._begin(percept)
        if self._thinks(percept):  # a thinking guest looks at the HUD, not at the room
            return Wait(self._thinks_until)
        self._look(percept)
        decision = self._turn_around(percept)
        if decision is None and not self._is_sensible(percept):
            self._decide(percept)
            decision = self._turn_around(percept)
        if decision is not None:
            return decision
        return Wait(self._thinks_until) if self._thinks(percept) else self._continue(percept)

    def _begin(self, percept: Percept) -> None:
        if not self._has_begun:
            self._has_begun, self._next_look = True, percept.time
            rows = 0 if BREADCRUMB in percept.shown_roles else len(percept.targets)
            self._thinks_until = percept.time + self._behaviour.timing.list_time(rows)

    def _thinks(self, percept: Percept) -> bool:
        return percept.time < self._thinks_until - TIME_TOLERANCE

    def _look(self, percept: Percept) -> None:
        for name in percept.carried:
            self._known.drop(name)
        self._brought |= self._carried - set(percept.carried)
        self._carried = set(percept.carried)
        if percept.time < self._next_look - TIME_TOLERANCE:
            return
        self._next_look = percept.time + percept.person.looking_interval
        room = self._house.rooms.room_at(percept.position)
        if room != self._room:
            self._room = room
            self._noticing.look_afresh()
        self._known.forget(percept.time, but=self._aim_object())
        poles = percept.flagpoles if self._misses_objects(percept) else {}
        found = {**self._noticing.notice(percept), **poles}
        self._known.learn(found, percept.time)
        self._brought -= set(found)
        for key in sorted(set(self._house.receptacles) - self._known.bins):
            if math.dist(self._house.approaches[key], percept.position) < SEEN_BIN:
                self._known.bins.add(key)
        self._frontier.mark_seen(percept, room, self._behaviour.perception.covers)
        self._look_around_if_there(percept)
        self._pick_up_in_passing(percept)

    def _look_around_if_there(self, percept: Percept) -> None:
        aim = self._intention.aim if self._intention is not None else None
        if not isinstance(aim, SearchPlace) or (
            self._frontier.is_left(aim) and not self._is_at(percept, aim.point)
        ):
            return
        self._frontier.mark_searched(aim)
        self._intention = None
        if float(self._rng.random()) < self._behaviour.perception.looks_around:
            self._noticing.look_afresh()
            self._turn = FullTurn(percept.heading)

    def _misses_objects(self, percept: Percept) -> bool:
        return len(self._known.objects) + len(self._carried) + len(self._brought) < len(percept.targets)

    def _pick_up_in_passing(self, percept: Percept) -> None:
        intention = self._intention
        if intention is None or not intention.suggested or percept.hands_full:
            return
        for name, place in self._known.objects.items():
            distance = math.dist(place, percept.position)
            near = distance <= self._adherence.compliance.beside
            if near and name not in self._passed and name != self._aim_object():
                self._passed.add(name)
                if self._adherence.picks_up(distance):
                    self._intention, self._stops = Intention(Visit(VisitKind.PICK, name)), []
                    return

    def _aim_object(self) -> str | None:
        aim = self._intention.aim if self._intention is not None else None
        return aim.object if isinstance(aim, Visit) else None

    def _is_sensible(self, percept: Percept) -> bool:
        intention = self._intention
        if intention is None:
            return False
        if isinstance(intention.aim, SearchPlace):
            return percept.hands_full or not self._options(percept, percept.guidance).objects
        if intention.suggested:
            is_shown = percept.guidance is not None and percept.guidance.visit == intention.aim
            if is_shown and percept.time >= intention.gives_up_at - TIME_TOLERANCE:
                self._given_up, self._is_open = intention.aim, False
                return False
            return is_shown
        if intention.aim.kind is VisitKind.PLACE:
            return intention.aim.object in percept.carried
        if self._has_gone(percept, intention.aim.object):
            self._known.drop(intention.aim.object)
        return intention.aim.object in self._known.objects and not percept.hands_full

    def _has_gone(self, percept: Percept, name: str) -> bool:
        refused = percept.answer is not None and not percept.answer.applied
        place = self._known.objects.get(name)
        near = place is not None and math.dist(place, percept.position) < GONE
        return refused and near and name not in percept.look() and name not in percept.flagpoles

    def _decide(self, percept: Percept) -> None:
        shown = percept.guidance
        self._intention, self._stops = None, []
        if shown is not None and shown.visit != self._read:
            self._read, self._given_up, self._is_open = shown.visit, None, True
            self._thinks_until = percept.time + self._behaviour.timing.suggestion_time()
            return
        if shown is not None and self._is_open:
            self._is_open = self._adherence.follows()
            if self._is_open:
                self._follow(percept, shown)
                return
        poles = FLAGPOLE in percept.shown_roles
        if poles and not self._known.objects and not percept.carried and not self._turned_for_poles:
            self._turn, self._turned_for_poles = FullTurn(percept.heading), True
            return
        aim = self._chooser.choose(percept, self._options(percept, shown))
        if aim is None and shown is not None:
            aim = shown.visit
        if aim is None:
            return
        self._turned_for_poles = False
        self._intention = Intention(aim)
        is_pole = poles and isinstance(aim, Visit) and aim.kind is VisitKind.PICK
        goal = self._goal(percept, aim, shown)
        self._stops = self._detours.stops(percept.position, goal, pole=is_pole)
        self._thinks_until = percept.time + self._behaviour.timing.choice_time(poles=poles)

    def _follow(self, percept: Percept, shown: Guidance) -> None:
        after = self._adherence.gives_up_after(path_length(shown.path) / percept.person.walking_speed)
        until = math.inf if after is None else percept.time + after
        off = project(shown.path, percept.position[0], percept.position[1])[1] > shown.tolerance
        self._intention = Intention(shown.visit, True, off, until)
        self._passed = set()

    def _options(self, percept: Percept, shown: Guidance | None) -> Known:
        objects = dict(self._known.objects)
        if shown is not None and shown.visit.kind is VisitKind.PICK:
            if self._given_up is None:
                objects[shown.visit.object] = shown.goal
            else:
                objects.pop(shown.visit.object, None)
        pull = self._behaviour.walking.pull if FLAGPOLE in percept.shown_roles else 0.0
        return Known(objects, pull, search=self._misses_objects(percept))

    def _goal(self, percept: Percept, aim: Visit | SearchPlace, shown: Guidance | None) -> Point:
        if isinstance(aim, SearchPlace):
            return aim.point
        if shown is not None and aim == shown.visit:
            self._known.learn({aim.object: shown.goal} if aim.kind is VisitKind.PICK else {}, percept.time)
            return shown.goal
        if aim.kind is VisitKind.PICK:
            return self._known.objects[aim.object]
        return self._house.approaches[percept.targets[aim.object]]

    def _turn_around(self, percept: Percept) -> Action | None:
        """Keep turning. After a full turn, the guest knows all bins in the room."""
        turning = self._turn.act(percept) if self._turn is not None else None
        if turning is None and self._turn is not None:
            self._turn = None
            bins = self._house.catalogue.receptacles
            self._known.bins |= {key for key in self._house.receptacles if bins[key].room == self._room}
        return turning

    def _continue(self, percept: Percept) -> Action:
        intention = self._intention
        if intention is None:
            return IDLE
        if self._stops and (percept.blocked or self._is_at(percept, self._stops[0])):
            self._stops.pop(0)
        if self._stops:
            until = min(self._next_look, intention.gives_up_at)
            return self._executor.walk_to(percept, self._stops[0], ARRIVED, until=until)
        if isinstance(intention.aim, SearchPlace):
            return self._executor.walk_to(percept, intention.aim.point, ARRIVED, until=self._next_look)
        return self._visit(percept, intention, intention.aim)

    def _is_at(self, percept: Percept, point: Point) -> bool:
        return math.dist(point, percept.position) <= ARRIVED

    def _visit(self, percept: Percept, intention: Intention, visit: Visit) -> Action:
        shown, until = percept.guidance, min(self._next_look, intention.gives_up_at)
        if intention.suggested and shown is not None:
            if percept.blocked and not intention.strays:
                self._intention = intention = replace(intention, strays=True)
            if not intention.strays:
                return self._executor.follow(percept, shown, until=until)
            return self._executor.act(percept, visit, {visit.object: shown.goal}, until=until)
        is_place = visit.kind is VisitKind.PLACE
        if is_place and (key := percept.targets[visit.object]) not in self._known.bins:
            place = self._frontier.of_room(self._house.catalogue.receptacles[key].room, percept.position)
            if not self._is_at(percept, place.point):
                return self._executor.walk_to(percept, place.point, ARRIVED, until=self._next_look)
            self._known.bins.add(key)
            self._turn = FullTurn(percept.heading)
            return self._turn_around(percept) or IDLE
        return self._executor.act(percept, visit, self._known.objects, until=self._next_look)
