// Where the page has its data from: the server, or the page itself if it was exported.

import type { Lit, ModuleAnswer, Passage, Report, RobotAnswer, RunEvent, RunState, Scene } from "./scene";

export type Arrays = Record<
  string,
  Float32Array | Float64Array | Uint8Array | Uint16Array | Uint32Array
>;

export interface Packed {
  head: { samples: number; rows: number; stride: number };
  arrays: Arrays;
}

export interface Source {
  // Whether more samples can come.
  readonly live: boolean;
  scenes(): Promise<Scene[]>;
  times(run: number, first: number): Promise<Float64Array>;
  samples(run: number, first: number, count: number, stride: number): Promise<Packed>;
  series(run: number): Promise<Packed>;
  // The last lines of all events and prints in which all of the words are, and how many there are.
  log(run: number, words: string): Promise<{ number: number; events: RunEvent[] }>;
  events(run: number): Promise<{ number: number; events: RunEvent[] }>;
  robot(run: number, robot: number): Promise<RobotAnswer>;
  module(run: number, module: [number, number]): Promise<ModuleAnswer>;
  reports(run: number, timeS: number): Promise<Report[]>;
  // Cells that are not dark at a time, if they were recorded.
  cells(run: number, timeS: number): Promise<Lit[]>;
  // Frames that robots received, if they were recorded: those that began between two times.
  frames(run: number, fromS: number, toS: number): Promise<Passage[]>;
  // Calls `seen` with each run's state when one has changed, and with null when the server is gone.
  watch(seen: (states: RunState[] | null) => void): void;
}

const TYPES = {
  float32: Float32Array,
  float64: Float64Array,
  uint8: Uint8Array,
  uint16: Uint16Array,
  uint32: Uint32Array,
} as const;

// The answer of kilotwin/runs/samples.py, pack(): length of the head, head, arrays.
export function unpack(data: ArrayBuffer): Packed {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  const arrays: Arrays = {};
  for (const [name, [type, at, size]] of Object.entries<[keyof typeof TYPES, number, number]>(
    head.arrays,
  )) {
    arrays[name] = new TYPES[type](data, 4 + length + at, size);
  }
  return { head, arrays };
}

export class Server implements Source {
  readonly live = true;

  scenes(): Promise<Scene[]> {
    return this.json("scenes");
  }

  async times(run: number, first: number): Promise<Float64Array> {
    const packed = await this.packed(`runs/${run}/times?first=${first}`);
    return packed.arrays.time_s as Float64Array;
  }

  samples(run: number, first: number, count: number, stride: number): Promise<Packed> {
    return this.packed(`runs/${run}/samples?first=${first}&count=${count}&stride=${stride}`);
  }

  series(run: number): Promise<Packed> {
    return this.packed(`runs/${run}/series`);
  }

  log(run: number, words: string): Promise<{ number: number; events: RunEvent[] }> {
    return this.json(`runs/${run}/log?words=${encodeURIComponent(words)}`);
  }

  events(run: number): Promise<{ number: number; events: RunEvent[] }> {
    return this.json(`runs/${run}/events`);
  }

  robot(run: number, robot: number): Promise<RobotAnswer> {
    return this.json(`runs/${run}/robots/${robot}`);
  }

  module(run: number, [column, row]: [number, number]): Promise<ModuleAnswer> {
    return this.json(`runs/${run}/modules/${column}/${row}`);
  }

  reports(run: number, timeS: number): Promise<Report[]> {
    return this.json(`runs/${run}/reports?time_s=${timeS}`);
  }

  cells(run: number, timeS: number): Promise<Lit[]> {
    return this.json(`runs/${run}/cells?time_s=${timeS}`);
  }

  frames(run: number, fromS: number, toS: number): Promise<Passage[]> {
    return this.json(`runs/${run}/frames?from_s=${fromS}&to_s=${toS}`);
  }

  watch(seen: (states: RunState[] | null) => void): void {
    const socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws")));
    socket.onmessage = (message) => seen(JSON.parse(message.data));
    socket.onclose = () => {
      seen(null);
      setTimeout(() => this.watch(seen), 2000);
    };
  }

  private async answer(path: string): Promise<Response> {
    const response = await fetch(path);
    if (!response.ok) throw new Error((await response.text()).trim());
    return response;
  }

  private async json<T>(path: string): Promise<T> {
    return (await this.answer(path)).json();
  }

  private async packed(path: string): Promise<Packed> {
    return unpack(await (await this.answer(path)).arrayBuffer());
  }
}
