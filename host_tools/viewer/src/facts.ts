// Facts about a robot, or a module, at the time that is shown: rows of name and value.

import type { Between } from "./samples";
import {
  uidOf,
  type Counters,
  type ModuleAnswer,
  type RobotAnswer,
  type RunEvent,
  type Scene,
} from "./scene";

export type Row = [string, string];

const TURN = 65536;
const CELLS = ["top left", "top right", "bottom left", "bottom right"];
// Events after which a module is in that state.
const MODULE_STATES: Record<string, string> = {
  module_silent: "does not answer",
  module_back: "answers again",
  module_pauses: "pauses",
  module_wrong: "runs another program, or another configuration",
  crash: "its program crashed",
  endless: "its program does not return",
  stack_overflow: "its stack overflowed",
  reset: "was reset",
};

export function robotRows(scene: Scene, between: Between, place: number, robot: number): Row[] {
  const { from } = between;
  const led = from.led[place] & 63;
  const levels = [led & 3, (led >> 2) & 3, (led >> 4) & 3].join(", ");
  const heading = (from.heading[place] / TURN) * 360;
  const informed = scene.informed.find(([a, b]) => a <= robot && robot < b);
  const rows: Row[] = [
    ["state", scene.states.names[scene.states.of_led[led]]],
    ["LED", `RGB(${levels})`],
    ["x, y", `${centimetres(from.x[place])}, ${centimetres(from.y[place])} cm`],
    ["heading", `${heading.toFixed(0)}°`],
    ...motionRows(between, place),
    ...extraRows(between, place),
  ];
  if (informed) rows.push(["informed of", scene.sites[informed[2] - 1].name]);
  return rows;
}

// The command that holds it there and then, line by line; empty for a real robot.
export function holding(scene: Scene, robot: number, timeS: number): string {
  if (!scene.emulated || timeS < 0) return "";
  return `kilotwin debug ${scene.folder} --robot ${uidOf(scene, robot)} --at ${timeS.toFixed(2)}`;
}

// How it moves between two samples, which is what its motors came to.
function motionRows({ from, to, spanS, earlier }: Between, place: number): Row[] {
  if (earlier || !spanS || Number.isNaN(from.x[place])) return [];
  const way = Math.hypot(to.x[place] - from.x[place], to.y[place] - from.y[place]);
  const turn = ((to.heading[place] - from.heading[place] + 1.5 * TURN) % TURN) - TURN / 2;
  const degrees = ((turn / TURN) * 360) / spanS;
  return [["moves", `${((1000 * way) / spanS).toFixed(1)} mm/s, turns ${degrees.toFixed(0)}°/s`]];
}

// Facts that were recorded besides, or that a moment tells.
function extraRows(between: Between, place: number): Row[] {
  const { motors, battery, messages } = between.from;
  const rows: Row[] = [];
  if (motors) rows.push(["motors", `left ${motors.left[place]}, right ${motors.right[place]}`]);
  if (battery) rows.push(["battery", `reads ${battery[place]}`]);
  if (messages) {
    const of = (what: "sent" | "received") => {
      const [before, after] = [(between.earlier ?? between.from).messages, between.to.messages];
      const number = messages[what][place];
      if (!between.spanS || !before || !after) return `${what} ${number}`;
      const rate = (after[what][place] - before[what][place]) / between.spanS;
      return `${what} ${number} (${rate.toFixed(1)}/s)`;
    };
    rows.push(["messages", `${of("sent")}, ${of("received")}`]);
  }
  return rows;
}

// The value that each of a robot's metrics had last.
export function metricRows(scene: Scene, metrics: RobotAnswer["metrics"], timeS: number): Row[] {
  return Object.entries(metrics).map(([name, values]) => {
    const value = values.findLast(([atS]) => atS <= timeS)?.[1];
    const unit = scene.metrics[name]?.unit ?? "";
    const text = value === undefined ? "not measured yet" : `${shortNumber(value)} ${unit}`;
    return [name.replace(/^metric_/, ""), text];
  });
}

export function cellRows(
  scene: Scene,
  module: [number, number],
  cell: number,
  timeS: number,
): Row[] {
  const grid = scene.grid!;
  const map = grid.maps.findLast(([atS]) => atS <= timeS)?.[1] ?? [];
  const numberOf = (of: number) => {
    const [row, column] = [2 * module[1] + (of < 2 ? 1 : 0), 2 * module[0] + (of % 2)];
    return row * 2 * grid.columns + column;
  };
  const siteOf = (of: number) => {
    const site = map[numberOf(of)];
    return site ? scene.sites[site - 1].name : "none";
  };
  return [
    ["cell", `${cell} (${CELLS[cell]})`],
    ["site", siteOf(cell)],
    ["wall", grid.walls.includes(numberOf(cell)) ? "yes" : "no"],
    ["configuration", [0, 1, 2, 3].map(siteOf).join(", ")],
  ];
}

// `now`: what a moment tells of its counters.
export function moduleRows(answer: ModuleAnswer, timeS: number, now: Counters | null): Row[] {
  const before = answer.events.filter((event) => event.time_s <= timeS);
  const last = before.findLast((event) => event.kind in MODULE_STATES);
  const counts = new Map<string, number>();
  for (const { kind } of before) counts.set(kind, (counts.get(kind) ?? 0) + 1);
  const counted = [...counts].map(([kind, number]) => `${kind} ${number}`).join(", ");
  return [
    ["state", last ? `${MODULE_STATES[last.kind]}, since ${last.time_s.toFixed(1)} s` : "answers"],
    ["events so far", counted || "none"],
    ...counterRows(now ?? (answer.counters.findLast(([atS]) => atS <= timeS)?.slice(1) as Counters)),
  ];
}

function counterRows(counters: Counters | undefined): Row[] {
  if (!counters) return [];
  const [state, can, transmit, receive, refused, missed] = counters;
  return [
    ["its runtime", state],
    ["CAN controller", `${can}, TEC ${transmit}, REC ${receive}`],
    ["CAN frames", `refused ${refused}, missed ${missed}`],
  ];
}

// `robot 5: `, `module 1-2: `; "" where it is of neither.
export function whoOf({ robot, uid, module }: RunEvent): string {
  if (robot !== undefined) return `robot ${uid ?? robot + 1}: `;
  return Array.isArray(module) ? `module ${module.join("-")}: ` : "";
}

export function textOf(event: RunEvent): string {
  if (event.kind === "print") return String(event.text);
  return event.text ? `${event.kind}: ${event.text}` : event.kind;
}

function centimetres(metres: number): string {
  return (100 * metres).toFixed(1);
}

function shortNumber(value: number): string {
  return Number.isInteger(value) ? String(value) : value.toPrecision(4);
}
