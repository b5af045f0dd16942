// The samples of one run in pieces, fetched when they are to be drawn.

import type { Arrays, Source } from "./source";

// One sample: an entry per recorded robot, in the order of the run's `recorded`.
export interface Sample {
  x: Float32Array;
  y: Float32Array;
  heading: Uint16Array; // in 2^16 parts of a turn
  led: Uint8Array;
  // Columns that were recorded besides; null: they were not.
  motors: { left: Uint8Array; right: Uint8Array } | null;
  battery: Uint16Array | null;
  messages: { sent: Uint32Array; received: Uint32Array } | null;
  metrics?: Arrays; // that were recorded of each robot, by their columns
  objects: { x: Float32Array; y: Float32Array; heading: Uint16Array } | null;
}

// Two samples and how far the time is between them, 0 to 1.
export interface Between {
  from: Sample;
  to: Sample;
  part: number;
  first: number; // number of `from`
  spanS?: number; // how long it is from one to the other
  earlier?: Sample; // of a moment: the one before
}

// Columns of robots besides, of arrays by the names of columns.
export function extrasOf(arrays: Arrays): Pick<Sample, "motors" | "battery" | "messages"> {
  const column = <T>(name: string) => arrays[name] as unknown as T;
  const motors = { left: column<Uint8Array>("left_duty"), right: column<Uint8Array>("right_duty") };
  const messages = {
    sent: column<Uint32Array>("sent"),
    received: column<Uint32Array>("received"),
  };
  return {
    motors: motors.left && motors.right ? motors : null,
    battery: column<Uint16Array>("battery") ?? null,
    messages: messages.sent && messages.received ? messages : null,
  };
}

function metricsOf(arrays: Arrays, part: (name: string) => Arrays[string]): Arrays {
  const names = Object.keys(arrays).filter((name) => name.startsWith("metric_"));
  return Object.fromEntries(names.map((name) => [name, part(name)]));
}

// Where a robot is at that time, m.
export function placeOf({ from, to, part }: Between, robot: number): [number, number] {
  return [
    from.x[robot] + part * (to.x[robot] - from.x[robot]),
    from.y[robot] + part * (to.y[robot] - from.y[robot]),
  ];
}

interface Chunk {
  samples: Sample[];
  rows: number;
}

const EXTRAS = ["left_duty", "right_duty", "battery", "sent", "received"];
const MOST_CACHED_ROWS = 8_000_000;
const CHUNK_ROWS = 200_000;
const MOST_ANSWERED_ROWS = 2_000_000; // the server answers with no more: kilotwin/runs/samples.py

export class Samples {
  // When each sample was taken, s.
  times = new Float64Array(0);
  // Called when samples have come that may be wanted.
  arrived: () => void = () => {};
  private readonly chunks = new Map<string, Chunk>();
  private readonly asked = new Set<string>();
  private cachedRows = 0;
  private readonly perChunk: number;

  constructor(
    private readonly source: Source,
    private readonly run: number,
    readonly size: number,
    readonly objects: number,
  ) {
    const fitting = Math.floor(CHUNK_ROWS / Math.max(1, size));
    const most = Math.max(1, Math.floor(MOST_ANSWERED_ROWS / Math.max(1, size)));
    this.perChunk = 2 ** Math.floor(Math.log2(Math.min(256, most, Math.max(4, fitting))));
  }

  get count(): number {
    return this.times.length;
  }

  // Takes in the times of samples that have come since.
  async extend(): Promise<void> {
    const more = await this.source.times(this.run, this.count);
    if (!more.length) return;
    const times = new Float64Array(this.count + more.length);
    times.set(this.times);
    times.set(more, this.count);
    // The last chunk of each stride may have been cut short.
    for (const [key, chunk] of this.chunks) {
      if (chunk.samples.length < this.perChunk) this.drop(key);
    }
    this.times = times;
  }

  // Number of the last sample at or before a time; 0 before the first.
  at(timeS: number): number {
    let low = 0;
    let high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= timeS) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  // The samples around a time, of every stride-th; null until they have come.
  between(timeS: number, stride: number): Between | null {
    if (!this.count) return null;
    const number = this.at(timeS);
    const first = number - (number % stride);
    const last = this.count - 1 - ((this.count - 1) % stride);
    const next = Math.min(first + stride, last);
    const from = this.sample(first, stride);
    const to = this.sample(next, stride);
    this.ask(this.keyOf(next + stride * this.perChunk, stride), stride);
    if (!from || !to) return null;
    const span = this.times[next] - this.times[first];
    const part = span > 0 ? Math.min(1, Math.max(0, (timeS - this.times[first]) / span)) : 0;
    return { from, to, part, first, spanS: span };
  }

  // Number `number`, a multiple of `stride`; null, and asked for, if it is not there yet.
  sample(number: number, stride: number): Sample | null {
    const key = this.keyOf(number, stride);
    const chunk = this.chunks.get(key);
    const place = (number / stride) % this.perChunk;
    if (!chunk || place >= chunk.samples.length) {
      this.ask(key, stride);
      return null;
    }
    this.chunks.delete(key);
    this.chunks.set(key, chunk);
    return chunk.samples[place];
  }

  private keyOf(number: number, stride: number): string {
    return `${stride}:${Math.floor(number / stride / this.perChunk)}`;
  }

  private async ask(key: string, stride: number): Promise<void> {
    const chunk = Number(key.split(":")[1]);
    const first = chunk * this.perChunk * stride;
    if (this.chunks.has(key) || this.asked.has(key) || first >= this.count) return;
    if (this.asked.size >= 4) return; // a slow server or page: the next frame asks again
    this.asked.add(key);
    try {
      const packed = await this.source.samples(this.run, first, this.perChunk, stride);
      this.keep(key, packed.arrays, packed.head.samples);
      this.arrived();
    } catch (error) {
      console.warn(`samples ${key}:`, error); // the next frame asks again
      await new Promise((resolve) => setTimeout(resolve, 500));
    } finally {
      this.asked.delete(key);
    }
  }

  private keep(key: string, arrays: Arrays, number: number): void {
    const samples: Sample[] = [];
    for (let k = 0; k < number; k++) samples.push(this.cut(arrays, k));
    const rows = number * this.size;
    this.drop(key);
    this.chunks.set(key, { samples, rows });
    this.cachedRows += rows;
    for (const oldest of this.chunks.keys()) {
      if (this.cachedRows <= MOST_CACHED_ROWS || this.chunks.size <= 3) break;
      this.drop(oldest);
    }
  }

  private drop(key: string): void {
    this.cachedRows -= this.chunks.get(key)?.rows ?? 0;
    this.chunks.delete(key);
  }

  private cut(arrays: Arrays, k: number): Sample {
    const part = <T extends Arrays[string]>(name: string, size: number, none: T): T =>
      name in arrays ? (arrays[name].subarray(k * size, (k + 1) * size) as T) : none;
    const nowhere = (size: number) => new Float32Array(size).fill(NaN);
    const pose = (prefix: string, size: number) => ({
      x: part(`${prefix}x_m`, size, nowhere(size)),
      y: part(`${prefix}y_m`, size, nowhere(size)),
      heading: part(`${prefix}heading_rad`, size, new Uint16Array(size)),
    });
    const extras: Arrays = {};
    for (const name of EXTRAS) {
      if (name in arrays) extras[name] = part(name, this.size, arrays[name]);
    }
    return {
      ...pose("", this.size),
      ...extrasOf(extras),
      metrics: metricsOf(arrays, (name) => part(name, this.size, arrays[name])),
      led: part("led", this.size, new Uint8Array(this.size)),
      objects: "object_x_m" in arrays ? pose("object_", this.objects) : null,
    };
  }
}

// Robots that are said to be in the same place stand in rings around it.
export function spreadSample(sample: Sample, radiusM: number): Sample {
  const [x, y] = [sample.x.slice(), sample.y.slice()];
  const there = new Map<string, number[]>();
  for (let k = 0; k < x.length; k++) {
    const key = `${x[k]},${y[k]}`;
    if (Number.isNaN(x[k])) continue;
    const others = there.get(key);
    if (others) others.push(k);
    else there.set(key, [k]);
  }
  for (const robots of there.values()) {
    if (robots.length < 2) continue;
    const distance = radiusM * Math.max(0.6, robots.length / 6);
    robots.forEach((k, n) => {
      const angle = (2 * Math.PI * n) / robots.length;
      x[k] += distance * Math.cos(angle);
      y[k] += distance * Math.sin(angle);
    });
  }
  return { ...sample, x, y };
}
