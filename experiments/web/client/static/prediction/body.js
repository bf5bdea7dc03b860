// Layout of the 16 numbers of a body, as mjsim/fidelity/body_state.py has it.

export const [X, Y, HEADING, PITCH] = [0, 1, 2, 3]; // m, m, rad (unwrapped), rad
export const [VX, VY, TURN_RATE, PITCH_RATE] = [4, 5, 6, 7]; // in the house frame, m/s, rad/s
export const [FORWARD, LEFT, TURN, LOOK] = [8, 9, 10, 11]; // commanded: m/s and rad/s in the body frame; pitch, rad
export const SERVO = 12; // first of four: the latest commands of x, y, yaw and pitch
export const BODY_SIZE = 16;
