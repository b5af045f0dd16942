// Runs that the page holds itself: a file without a server. The other side is
// kilotwin/view/exported_page.py.

import type { Lit, ModuleAnswer, Passage, Report, RobotAnswer, RunEvent, Scene } from "./scene";
import { whoOf } from "./facts";
import { unpack, type Arrays, type Packed, type Source } from "./source";

const REPORT_COLUMNS = 7;
const NOWHERE = 65535;
const MOST_LINES = 200;
const MOST_LOGGED = 1000;
const HEADING_SHIFT = 6;
// Columns of robots besides their poses.
const WHOLE: Record<string, { from(of: Uint16Array, value: (one: number) => number): Arrays[string] }> = {
  left_duty: Uint8Array,
  right_duty: Uint8Array,
  battery: Uint16Array,
  sent: Uint32Array,
  received: Uint32Array,
};

interface Held {
  scene: Scene;
  events: RunEvent[];
  number: number; // of all events, also those that are not in it
  times: Float64Array;
  reports: Float64Array; // rows of REPORT_COLUMNS
  series: Packed;
  arrays: Arrays; // of a sample after the other, a value per robot or object
}

export class Exported implements Source {
  readonly live = false;

  private constructor(private readonly runs: Held[]) {}

  // Null if the page holds no runs.
  static async read(): Promise<Exported | null> {
    const texts = [...document.querySelectorAll("script.run")].map((one) => one.textContent ?? "");
    if (!texts.length) return null;
    return new Exported(await Promise.all(texts.map(async (text) => held(await inflated(text)))));
  }

  async scenes(): Promise<Scene[]> {
    return this.runs.map((run) => run.scene);
  }

  async times(run: number, first: number): Promise<Float64Array> {
    return this.runs[run].times.subarray(first);
  }

  async samples(run: number, first: number, count: number, stride: number): Promise<Packed> {
    const { arrays, times } = this.runs[run];
    const number = Math.min(count, Math.ceil((times.length - first) / stride));
    const part: Arrays = {};
    for (const [name, values] of Object.entries(arrays)) {
      const size = values.length / times.length;
      const cut = new (values.constructor as Float32ArrayConstructor)(number * size);
      for (let k = 0; k < number; k++) {
        const at = (first + k * stride) * size;
        cut.set(values.subarray(at, at + size), k * size);
      }
      part[name] = cut;
    }
    return { head: { samples: number, rows: 0, stride }, arrays: part };
  }

  async series(run: number): Promise<Packed> {
    return this.runs[run].series;
  }

  async events(run: number): Promise<{ number: number; events: RunEvent[] }> {
    const events = this.runs[run].events.filter((event) => event.kind !== "print");
    return { number: events.length, events };
  }

  async log(run: number, words: string): Promise<{ number: number; events: RunEvent[] }> {
    const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
    const found = this.runs[run].events.filter((event) => {
      const line = `${whoOf(event)}${event.kind} ${event.text ?? ""}`.toLowerCase();
      return wanted.every((word) => line.includes(word));
    });
    return { number: found.length, events: found.slice(-MOST_LOGGED) };
  }

  async robot(run: number, robot: number): Promise<RobotAnswer> {
    const { scene, times, arrays, events } = this.runs[run];
    const place = scene.recorded ? scene.recorded.indexOf(robot) : robot;
    const history: [number, number][] = [];
    const led = arrays.led;
    for (let k = 0; led && k < times.length; k++) {
      const now = led[(k * led.length) / times.length + place];
      if (now !== history.at(-1)?.[1]) history.push([times[k], now]);
    }
    const its = events.filter((event) => event.robot === robot);
    return { history, metrics: {}, number: its.length, events: its, words: [] };
  }

  async module(run: number, [column, row]: [number, number]): Promise<ModuleAnswer> {
    const { reports, events } = this.runs[run];
    const its = events.filter(({ module: at }) => {
      return Array.isArray(at) && at[0] === column && at[1] === row;
    });
    const found: ModuleAnswer["reports"] = [];
    for (let at = 0; at < reports.length; at += REPORT_COLUMNS) {
      const [timeS, robot, , , x, y, cell] = reports.subarray(at, at + REPORT_COLUMNS);
      if (x === column && y === row) found.push([timeS, robot, cell, null]);
    }
    return { counters: [], events: its, number: found.length, reports: found.slice(-MOST_LINES) };
  }

  // The last report of each robot by then.
  // A page to mail has neither: they are many.
  async cells(): Promise<Lit[]> {
    return [];
  }

  async frames(): Promise<Passage[]> {
    return [];
  }

  async reports(run: number, timeS: number): Promise<Report[]> {
    const { reports } = this.runs[run];
    const last = new Map<number, Report>();
    for (let at = 0; at < reports.length && reports[at] <= timeS; at += REPORT_COLUMNS) {
      last.set(reports[at + 1], [...reports.subarray(at, at + REPORT_COLUMNS)] as Report);
    }
    return [...last.values()];
  }

  watch(): void {}
}

async function inflated(text: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

function held(data: ArrayBuffer): Held {
  const { head, arrays } = unpack(data);
  const { scene, events, number } = head as unknown as Pick<Held, "scene" | "events" | "number">;
  const times = arrays.time_s as Float64Array;
  const made: Arrays = {};
  for (const [name, values] of Object.entries(arrays)) {
    if (name.endsWith("led")) {
      made[name] = turned(values as Uint8Array, times.length);
    } else if (name.endsWith("heading_rad")) {
      made[name] = summed(values as Uint8Array, times.length).map((one) => one << HEADING_SHIFT);
    } else if (`${name}.scale` in arrays) {
      const [low, step] = arrays[`${name}.scale`];
      const numbers = summed(values as Uint8Array, times.length);
      const value = (one: number) => (one === NOWHERE ? NaN : low + one * step);
      made[name] = (WHOLE[name] ?? Float32Array).from(numbers, value);
    }
  }
  const reports = arrays.reports as Float64Array;
  const series = unpack((arrays.series as Uint8Array).slice().buffer);
  return { scene, events, number, times, reports, series, arrays: made };
}

// [samples, robots] of [robots, samples].
function turned(values: Uint8Array, samples: number): Uint8Array {
  const robots = values.length / samples;
  const made = new Uint8Array(values.length);
  for (let i = 0; i < robots; i++) {
    for (let k = 0; k < samples; k++) made[k * robots + i] = values[i * samples + k];
  }
  return made;
}

// [samples, robots] of the folded differences of each robot's values: low bytes, then high ones.
function summed(bytes: Uint8Array, samples: number): Uint16Array {
  const number = bytes.length / 2;
  const robots = number / samples;
  const made = new Uint16Array(number);
  for (let i = 0; i < robots; i++) {
    let value = 0;
    for (let k = 0; k < samples; k++) {
      const at = i * samples + k;
      const folded = bytes[at] | (bytes[number + at] << 8);
      value = (value + ((folded >> 1) ^ -(folded & 1))) & 0xffff;
      made[k * robots + i] = value;
    }
  }
  return made;
}
