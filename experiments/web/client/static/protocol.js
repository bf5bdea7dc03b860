// Types and constants of docs/protocol.md, made by `make client-protocol`; change them in experiments/web/protocol.py.

/** @typedef {"jpeg" | "h264" | "none"} Codec */
/** @typedef {"asked" | "hidden" | "disconnected" | "silent" | "restarted" | "taken over"} PauseReason */
/** @typedef {"loading" | "ready" | "running" | "paused" | "over" | "failed"} Phase */
/** @typedef {{ type: "view"; width: number; height: number; codec?: "h264" | "jpeg" | "none"; field_of_view?: number | null }} View Requested view: its size in CSS pixels, and the codec of frames, or `none` if the page draws. */
/** @typedef {{ type: "hello"; tab: string; trial: string; view: View }} Hello First message of a connection. `tab` is a random name of the page. It stays the same after a reconnection. */
/** @typedef {{ type: "takeover" }} TakeOver Continue here a session that is open in another page. This is the reply to `occupied`. */
/** @typedef {{ type: "run"; until?: number | null }} RunMessage Start or resume the clock. `until` is the page's first promise (see `Inputs`), or None without promises. */
/** @typedef {{ number: number; step?: number | null; forward?: number; left?: number; turn?: number; look?: number; yaw?: number; pitch?: number; press?: "act" | "left hand" | "right hand" | null; scroll?: number }} Input A change of the keyboard, mouse, gamepad or touch screen. */
/** @typedef {{ type: "inputs"; inputs: Array<Input>; until?: number | null }} Inputs Inputs of the participant in chronological order. Each input is sent once. */
/** @typedef {{ type: "seen"; frame: number }} Seen Acknowledgement that the browser has shown a frame. `frame` is its number. */
/** @typedef {{ type: "beat" }} Beat Heartbeat. The server sends two per second, and the page answers each. */
/** @typedef {{ type: "display"; draw: "browser" | "server"; renderer: string; width: number; height: number; pixel_ratio: number; frames_per_s: number; frame_ms: number; frame_ms_95: number; dropped: number; latency_ms?: number | null; field_of_view?: number | null }} Display Display quality over the last 5 s, which is written to the log. */
/** @typedef {{ type: "draw"; draw: "browser" | "server"; reason: string }} Draw Change of the program that draws the view, and its reason. Both are written to the log. */
/** @typedef {{ type: "pause"; reason: "asked" | "disconnected" | "hidden" | "restarted" | "silent" | "taken over" }} Pause Stop the clock. The reason is written to the log. */
/** @typedef {{ type: "blur"; away: boolean }} Blur Loss or return of the keyboard focus, which is written to the log. */
/** @typedef {{ type: "leave" }} Leave End the trial immediately. */
/** @typedef {{ type: "state"; phase: Phase; reason: string; input: number }} State State of the session, the reason for a pause, end or failure, and the number of the last received input. */
/** @typedef {{ type: "taken"; input: number; step: number }} Taken All inputs and control steps up to these numbers have been processed and are on disk. */
/** @typedef {{ max_speed: number; max_turn: number; max_look: number; acceleration: number; turn_acceleration: number; dt: number; substeps: number; mass: number; walk_gain: number; walk_force: number; inertia: number; turn_gain: number; turn_force: number; head_inertia: number; head_stiffness: number; head_damping: number; head_force: number; lowest: number; highest: number; radius: number; eye_height: number; eye_forward: number }} GaitParameters Parameters of walking in SI units. The fields are those of `mjsim.world.fidelity.kinematics.Gait`. */
/** @typedef {{ walking_speed: number; turning_speed: number; looking_speed: number }} Speeds Speeds of the participant at full deflection of the controls, in m/s and rad/s. */
/** @typedef {{ type: "scene"; path: string | null; floor: string | null; gait: GaitParameters; speeds: Speeds; field_of_view: number; field_of_view_range: [number, number] | null; step_duration: number }} SceneMessage Scene to be drawn by the client. It is sent once. */
/** @typedef {{ type: "snapshot"; step: number; input: number; time: number; busy: boolean; body: Array<number>; eye: Array<number>; hands: Array<Array<number>>; held: [string | null, string | null]; objects: Record<string, Array<number>>; models: Record<string, string>; gone: Array<string> }} Snapshot State at the start of a control step, for clients that draw. One is sent per control step. */
/** @typedef {{ shape: "box" | "cylinder" | "sphere"; position: [number, number, number]; size: [number, number, number]; rgba: [number, number, number, number]; role: string; x_ray: boolean; object: string | null; outlined: boolean }} Marker A virtual object in the world. */
/** @typedef {{ type: "markers"; markers: Array<Marker> }} Markers Markers of the HUD, for clients that draw. They are sent when they change. */
/** @typedef {{ type: "pictures"; pictures: Record<string, string> }} Pictures Pictures that a `hud` message refers to, as data URLs by key. They are sent once to each page. */
/** @typedef {{ text: string; detail: string; picture: string | null; target_picture: string | null; number: number | null; done: boolean; current: boolean; carried: boolean }} ChecklistItem A row of the task list. */
/** @typedef {{ label: string; place: string; picture: string | null }} BinEntry A receptacle in the list of bins. `place` is broken at its line break if it does not fit on one line. */
/** @typedef {{ label: string | null; picture: string | null }} InventorySlot Contents of a hand. Both fields are None if the hand is empty. */
/** @typedef {{ text: string; kind: "info" | "success" | "refusal"; opacity: number }} HudMessage A message with its current opacity, from 0 (invisible) to 1. */
/** @typedef {{ angle: number }} Pointer An arrow at the edge of the view towards a goal outside it. */
/** @typedef {{ picture: string; bounds: [number, number, number, number]; position: [number, number]; heading: number; path: Array<[number, number]>; objects: Array<[number, number]>; goal: [number, number] | null }} MiniMap A map of the house with north (+y) up. */
/** @typedef {{ checklist_title: string; checklist: Array<ChecklistItem>; bins: Array<BinEntry>; inventory: [InventorySlot | null, InventorySlot]; message: HudMessage | null; markers: Array<Marker>; rerouted: boolean; delivered: number; total: number; clock: number | null; pointer: Pointer | null; minimap: MiniMap | null; scroll: number }} HudState Everything that the HUD shows. */
/** @typedef {{ type: "hud"; state: HudState }} Hud State of the HUD, without markers and the values sent in `moment`. */
/** @typedef {{ object: string; receptacle: string | null; at: [number, number] | null; instance: string; place: [number, number, number] }} Reach Effect of the action key: the object that it would pick up or place, and the receptacle when placing. */
/** @typedef {{ type: "moment"; step: number; clock: number | null; room: string; reach: Reach | null; pointer: Pointer | null; minimap: MiniMap | null }} Moment Values that change with movement: clock in whole seconds, room, object within reach, pointer and map. */
/** @typedef {{ type: "busy"; busy: boolean }} Busy Start or end of a pick or place, for clients that show frames. Key presses in between are handled afterwards. */
/** @typedef {{ type: "saved" }} Saved The run directory of a finished session is complete. */
/** @typedef {{ type: "queue" }} Queue All slots are taken. The page must reload to show the queue. */
/** @typedef {{ type: "occupied" }} Occupied The session is open in another page. The reply `takeover` continues it here. */
/** @typedef {{ type: "replaced" }} Replaced Another page has taken over the session, so this connection will be closed. */
/** @typedef {{ type: "error"; code: "idle" | "malformed" | "out of order" | "too early" | "too much"; message: string }} Error Rejection of a message, with an error code and a reason. */
/** @typedef {{ type: "frame"; number: number; step: number; input: number; codec: "h264" | "jpeg" | "none"; key: boolean; width: number; height: number; milliseconds: number; data: Uint8Array<ArrayBuffer> }} FrameMessage A frame and its control step. Frames are numbered from 1 in each view. `input` is the last input in effect. */
/** @typedef {Hello | TakeOver | RunMessage | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave} FromBrowser */
/** @typedef {State | Taken | SceneMessage | Snapshot | Markers | Pictures | Hud | Moment | Busy | Beat | Saved | Queue | Occupied | Replaced | Error} ToBrowser */

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
export const SLOW = 4004;
/** @type {Record<Phase, Record<string, Phase>>} phase -> trigger -> phase that follows */
export const TRANSITIONS = {
  loading: { opened: "ready", restored: "paused", end: "over", fail: "failed" },
  ready: { run: "running", end: "over", fail: "failed" },
  running: { pause: "paused", end: "over", fail: "failed" },
  paused: { run: "running", end: "over", fail: "failed" },
  over: { fail: "failed" },
  failed: {  },
};
