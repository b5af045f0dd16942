// Moments of a run that goes on in the server's hands: all robots as they are now, whether or not
// that is a sample. The next is asked for when one has been drawn, so that a slow page has fewer.

import { extrasOf, type Sample } from "./samples";
import type { Counters, Scene } from "./scene";
import { unpack, type Arrays } from "./source";

export interface Moment {
  timeS: number;
  sample: Sample;
  earlier: Sample | null; // of the moment before
  spanS: number; // since then
  paused: boolean;
  speed: number | null; // times real time; null: as fast as it can
  modules: Map<string, Counters>; // by "x,y"
}

interface Head {
  modules?: [number, number, ...Counters][];
  time_s: number;
  paused: boolean;
  speed: number | null;
}

const LEAST_MS = 100; // from one to the next

export class Moments {
  latest: Moment | null = null;
  // Called when one has come, and when there will be no more.
  changed: () => void = () => {};
  // Whether motors, batteries and counts of messages are wanted, too.
  closely = false;
  // Whether there will be no more.
  over = false;

  constructor(private readonly scene: Scene) {
    const socket = new WebSocket(new URL("moments", location.href.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    const ask = () =>
      requestAnimationFrame(() => {
        if (socket.readyState === 1) socket.send(this.closely ? "closely" : "look");
      });
    socket.onopen = ask;
    socket.onmessage = (message) => {
      this.take(message.data);
      setTimeout(ask, LEAST_MS);
    };
    socket.onclose = () => {
      this.latest = null;
      this.over = true;
      this.changed();
    };
  }

  private take(data: ArrayBuffer): void {
    const { head, arrays } = unpack(data) as unknown as { head: Head; arrays: Arrays };
    const pose = (prefix: string) => ({
      x: arrays[`${prefix}x_m`] as Float32Array,
      y: arrays[`${prefix}y_m`] as Float32Array,
      heading: arrays[`${prefix}heading_rad`] as Uint16Array,
    });
    const objects = "object_x_m" in arrays ? pose("object_") : null;
    const all = { ...pose(""), ...extrasOf(arrays), led: arrays.led as Uint8Array, objects };
    const { time_s: timeS, paused, speed } = head;
    const before = this.latest;
    const spanS = before ? timeS - before.timeS : 0;
    const sample = this.recorded(all);
    const modules = new Map<string, Counters>();
    for (const [x, y, ...counters] of head.modules ?? []) modules.set(`${x},${y}`, counters);
    this.latest = { timeS, sample, modules, earlier: before?.sample ?? null, spanS, paused, speed };
    this.changed();
  }

  // Those that samples have too.
  private recorded(all: Sample): Sample {
    const ids = this.scene.recorded;
    if (!ids) return all;
    const wanted = new Set(ids);
    const chosen = <T extends Arrays[string]>(of: T) =>
      (of as Uint8Array).filter((_, k) => wanted.has(k)) as unknown as T;
    const { motors, battery, messages } = all;
    return {
      x: chosen(all.x),
      y: chosen(all.y),
      heading: chosen(all.heading),
      led: chosen(all.led),
      motors: motors && { left: chosen(motors.left), right: chosen(motors.right) },
      battery: battery && chosen(battery),
      messages: messages && { sent: chosen(messages.sent), received: chosen(messages.received) },
      objects: all.objects,
    };
  }
}
