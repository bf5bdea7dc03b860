// A person on an empty floor, for tests.

export const DT = 0.04;
export const SPEEDS = { walking_speed: 1.3, turning_speed: 2.5, looking_speed: 1.5 };
export const GAIT = {
  max_speed: 1.4, max_turn: 2.5, max_look: 1.5, acceleration: 3, turn_acceleration: 15, dt: DT, substeps: 10, mass: 70,
  walk_gain: 7000, walk_force: 600, inertia: 2.3, turn_gain: 250, turn_force: 120, head_inertia: 0.03,
  head_stiffness: 120, head_damping: 4, head_force: 40, lowest: -1.3, highest: 1.05, radius: 0.2, eye_height: 1.6,
  eye_forward: 0.06,
};
export const EMPTY = {
  edges: [], first: [0], boxes: [], near: [], near_first: [0, 0], origin_x: 0, origin_y: 0, rows: 1, columns: 1,
  cell: 0.25, margin: 0.12,
};
