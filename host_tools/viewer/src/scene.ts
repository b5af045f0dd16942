// Types of the server's answers. A scene is all of a run that does not change with time
// (kilotwin/runs/scene.py).
// Lengths in metres, angles in radians, colours as #rrggbb.

import type { Offers } from "./steering";

export type Shape = { circle: [number, number, number] } | { polygon: [number, number][] };

export interface Site {
  name: string;
  colour: string;
  circle?: [number, number, number];
  polygon?: [number, number][];
}

// A picture on the floor: left, low, right and top in metres, and a PNG in base64.
export interface Drawn {
  box: [number, number, number, number];
  png: string;
}

export interface Grid {
  columns: number;
  rows: number;
  cell_m: number;
  walls: number[];
  maps: [number, number[]][];
  // Whether what cells show was recorded, which `cells` of the source says.
  recorded: boolean;
}

export interface RunState {
  status: string;
  samples: number;
  first_s: number;
  last_s: number;
  // A line if programs change LEDs more often than samples were taken; else empty.
  coarse: string;
}

// A frame from robot to robot, by their indices.
export interface Passage {
  begin_s: number;
  at_s: number;
  from: number;
  to: number;
}

export interface Scene extends RunState {
  name: string;
  seed: number;
  folder: string;
  emulated: boolean;
  // Columns of robots that were recorded besides: motors, battery, messages.
  also: string[];
  // Whether it goes on here, so that `moments` of it are served.
  moments: boolean;
  // The orders that it takes; null: none.
  steers: Offers | null;
  // Whether it is what a listener hears on a grid's buses.
  buses: boolean;
  robots: number;
  // By index, of a lab's robots; null: the index and 1.
  uids: number[] | null;
  recorded: number[] | null;
  radius_m: number;
  range_m: number;
  duration_s: number;
  tick_s: number;
  arena: Shape;
  sites: Site[];
  floor: Drawn | null;
  light: Drawn | null;
  obstacles: Shape[];
  objects: Shape[][];
  grid: Grid | null;
  informed: [number, number, number][];
  states: { names: string[]; known: number; of_led: number[]; colours: string[] };
  leds: string[];
  // Kinds of events after which a robot's program does not go on.
  failures: string[];
  metrics: Record<string, { unit: string; meaning: string }>;
  // The chain that `kilotwin why` has told last, from its end on.
  why: { lines: Passage[] } | null;
}

export interface RunEvent {
  time_s: number;
  kind: string;
  robot?: number;
  uid?: number; // older runs have none
  text?: string;
  [more: string]: unknown;
}

export interface RobotAnswer {
  history: [number, number][];
  metrics: Record<string, [number, number][]>; // time in s and value
  number: number;
  events: RunEvent[];
  words: [number, number, number | null][]; // time in s, type, value
}

// Counters of a module: state, state of its CAN controller, transmit and receive errors, frames it
// refused, frames it missed.
export type Counters = [string, string, number, number, number, number];

export interface ModuleAnswer {
  counters: [number, ...Counters][]; // from a time in s on
  events: RunEvent[];
  number: number; // of reports
  reports: [number, number, number, string | null][]; // time in s, robot, cell, state
}

// cell, colour (bit 0 red, bit 1 green, bit 2 blue), brightness of 255
export type Lit = [number, number, number];

// time in s, robot, x, y, column and row of the module, cell
export type Report = [number, number, number, number, number, number, number];

export function isShape(site: Site): site is Site & Shape {
  return site.circle !== undefined || site.polygon !== undefined;
}

// [left, low, right, top] of a shape.
export function boxOf(shape: Shape): [number, number, number, number] {
  if ("circle" in shape) {
    const [x, y, r] = shape.circle;
    return [x - r, y - r, x + r, y + r];
  }
  const xs = shape.polygon.map((p) => p[0]);
  const ys = shape.polygon.map((p) => p[1]);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

// The uid with which a robot begins, by its index.
export function uidOf(scene: Scene, robot: number): number {
  return scene.uids?.[robot] ?? robot + 1;
}

// The index of the robot that begins with that uid; -1: there is none.
export function robotOf(scene: Scene, uid: number): number {
  return scene.uids ? scene.uids.indexOf(uid) : uid - 1;
}
