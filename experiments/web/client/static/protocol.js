// Types and constants of docs/protocol.md, made by `make client-protocol`; change them in experiments/web/protocol.py.

/** @typedef {"jpeg" | "h264" | "none"} Codec */
/** @typedef {"asked" | "hidden" | "disconnected" | "silent" | "restarted" | "taken over" | "picture lost"} PauseReason */
/** @typedef {"loading" | "ready" | "running" | "paused" | "over" | "failed"} Phase */
/** @typedef {{ type: "view"; width: number; height: number; codec?: "h264" | "jpeg" | "none"; field_of_view?: number | null }} View A request for a view of this size in CSS pixels. The codec is `none` if the page itself draws the view. */
/** @typedef {{ type: "hello"; tab: string; trial: string; view: View }} Hello The first message of a connection. `tab` is a random name that the page keeps when it reconnects. */
/** @typedef {{ type: "takeover" }} TakeOver A request to continue a session that is open on another page. Clients send it after an `occupied` message. */
/** @typedef {{ type: "run"; until?: number | null }} RunMessage A request to start or resume the clock. `until` is the first promise (see `Inputs`), or None. */
/** @typedef {{ number: number; step?: number | null; forward?: number; left?: number; turn?: number; look?: number; yaw?: number; pitch?: number; press?: "act" | "left hand" | "right hand" | null; scroll?: number }} Input An input event from the keyboard, mouse, gamepad or touch screen. */
/** @typedef {{ type: "inputs"; inputs: Array<Input>; until?: number | null }} Inputs The participant's inputs in chronological order. Each input is sent only once. */
/** @typedef {{ type: "seen"; frame: number }} Seen An acknowledgement that the browser has shown the frame with this number. */
/** @typedef {{ type: "beat" }} Beat A heartbeat. The server sends two per second, and the page answers each of them. */
/** @typedef {{ type: "display"; draw: "browser" | "server"; renderer: string; width: number; height: number; pixel_ratio: number; frames_per_s: number; frame_ms: number; frame_ms_95: number; dropped: number; latency_ms?: number | null; field_of_view?: number | null }} Display A report on the display quality over the last 5 s, which is written to the log as a `DisplayEvent`. */
/** @typedef {{ type: "draw"; draw: "browser" | "server"; reason: string }} Draw A notice that says whether the browser or the server now draws the view. It is logged with the reason. */
/** @typedef {{ type: "pause"; reason: "asked" | "disconnected" | "hidden" | "picture lost" | "restarted" | "silent" | "taken over" }} Pause A request to stop the clock. The reason is written to the log. */
/** @typedef {{ type: "blur"; away: boolean }} Blur A notice that the page has lost or regained the keyboard focus. It is written to the log. */
/** @typedef {{ type: "leave" }} Leave A request to end the trial immediately. */
/** @typedef {{ type: "state"; phase: Phase; reason: string; input: number }} State The state of a session. `reason` explains a pause, end or failure. `input` numbers the last input. */
/** @typedef {{ type: "taken"; input: number; step: number }} Taken An acknowledgement that all inputs and control steps up to these numbers are on disk. */
/** @typedef {{ max_speed: number; max_turn: number; max_look: number; acceleration: number; turn_acceleration: number; dt: number; substeps: number; mass: number; walk_gain: number; walk_force: number; inertia: number; turn_gain: number; turn_force: number; head_inertia: number; head_stiffness: number; head_damping: number; head_force: number; lowest: number; highest: number; radius: number; eye_height: number; eye_forward: number }} GaitParameters Walking parameters in SI units, with the same fields as `mjsim.world.fidelity.kinematics.Gait`. */
/** @typedef {{ walking_speed: number; turning_speed: number; looking_speed: number }} Speeds The participant's speeds at full deflection of the controls, in m/s and rad/s. */
/** @typedef {{ type: "scene"; path: string | null; floor: string | null; gait: GaitParameters; speeds: Speeds; field_of_view: number; field_of_view_range: [number, number] | null; step_duration: number }} SceneMessage The scene that the client draws. It is sent once. */
/** @typedef {{ type: "snapshot"; step: number; input: number; time: number; busy: boolean; body: Array<number>; eye: Array<number>; hands: Array<Array<number>>; held: [string | null, string | null]; objects: Record<string, Array<number>>; models: Record<string, string>; gone: Array<string> }} Snapshot The state at the start of a control step. One snapshot per step is sent to clients that draw the view. */
/** @typedef {{ shape: "box" | "cylinder" | "sphere"; position: [number, number, number]; size: [number, number, number]; rgba: [number, number, number, number]; role: string; x_ray: boolean; object: string | null; outlined: boolean }} Marker A virtual object that is drawn in the house. */
/** @typedef {{ type: "markers"; markers: Array<Marker> }} Markers The markers of the HUD. They are sent to clients that draw the view whenever they change. */
/** @typedef {{ type: "pictures"; pictures: Record<string, string>; example: Record<string, string>; markers: Array<string> }} Pictures The pictures that `hud` messages refer to, which are sent once to each page. Keys map to data URLs. */
/** @typedef {{ text: string; detail: string; picture: string | null; target_picture: string | null; number: number | null; done: boolean; current: boolean; carried: boolean }} ChecklistItem A row of the task list. */
/** @typedef {{ label: string; place: string; picture: string | null }} BinEntry A receptacle in the list of bins. `place` is split at its line break if it is too long for one line. */
/** @typedef {{ label: string | null; picture: string | null }} InventorySlot The contents of a hand. Both fields are None if the hand is empty. */
/** @typedef {{ text: string; kind: "info" | "success" | "refusal"; opacity: number }} HudMessage A message with its current opacity, from 0 (invisible) to 1. */
/** @typedef {{ angle: number }} Pointer An arrow at the edge of the view that points to a goal outside the view. */
/** @typedef {{ picture: string; bounds: [number, number, number, number]; position: [number, number]; heading: number; path: Array<[number, number]>; objects: Array<[number, number]>; goal: [number, number] | null }} MiniMap A map of the house with north (+y) at the top. */
/** @typedef {{ checklist_title: string; checklist: Array<ChecklistItem>; bins: Array<BinEntry>; inventory: [InventorySlot | null, InventorySlot]; message: HudMessage | null; markers: Array<Marker>; rerouted: boolean; delivered: number; total: number; clock: number | null; pointer: Pointer | null; minimap: MiniMap | null; scroll: number }} HudState The content of the HUD at one moment. */
/** @typedef {{ type: "hud"; state: HudState }} Hud The state of the HUD, except for the markers and the values in `moment` messages. */
/** @typedef {{ object: string; receptacle: string | null; at: [number, number] | null; instance: string; place: [number, number, number] }} Reach The object that the action key would pick up or place, and the receptacle in which it would be placed. */
/** @typedef {{ type: "moment"; step: number; clock: number | null; room: string; reach: Reach | null; pointer: Pointer | null; minimap: MiniMap | null }} Moment HUD values that change often: clock in whole seconds, room, object within reach, pointer and map. */
/** @typedef {{ type: "busy"; busy: boolean }} Busy A notice that a pick or place has started or ended. It is only sent to clients that show frames. */
/** @typedef {{ type: "saved" }} Saved A notice that the run directory of a finished session is complete. */
/** @typedef {{ type: "queue" }} Queue A notice that all slots are taken. The page must reload to show the queue. */
/** @typedef {{ type: "occupied" }} Occupied A notice that the session is open in another page. The reply `takeover` continues it in this page. */
/** @typedef {{ type: "replaced" }} Replaced A notice that another page has taken over the session. This connection will be closed. */
/** @typedef {{ type: "error"; code: "idle" | "malformed" | "out of order" | "too early" | "too much"; message: string }} Error The rejection of a message, with an error code and a reason. */
/** @typedef {{ type: "frame"; number: number; step: number; input: number; codec: "h264" | "jpeg" | "none"; key: boolean; width: number; height: number; milliseconds: number; data: Uint8Array<ArrayBuffer> }} FrameMessage A rendered frame. Frames are numbered from 1 in each view. */
/** @typedef {Hello | TakeOver | RunMessage | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave} FromBrowser */
/** @typedef {State | Taken | SceneMessage | Snapshot | Markers | Pictures | Hud | Moment | Busy | Saved | Beat | Queue | Occupied | Replaced | Error} ToBrowser */

export const FRAME_HEAD_BYTES = 28;
/** @type {Record<number, Codec>} */
export const CODECS = { 1: "jpeg", 2: "h264" };
export const MAX_INPUTS = 64;
export const BEAT_PERIOD = 0.5;
export const MAX_SILENCE = 1.0;
export const MAX_STEPS_AHEAD = 25;
export const DISPLAY_PERIOD = 5.0;
export const KEY_FLAG = 1;
export const REFUSED = 4000;
export const REPLACED = 4001;
export const IDLE = 4002;
export const TOO_MUCH = 4003;
/** @type {readonly Phase[]} phases in which the clock can be started */
export const STARTABLE = ["ready", "paused"];
