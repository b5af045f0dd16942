// Moments of a run that goes on in the server's hands: all robots as they are now, whether or not
// that is a sample. The next is asked for when one has been drawn, so that a slow page has fewer.

import type { Sample } from "./samples";
import type { Scene } from "./scene";
import { unpack, type Arrays } from "./source";

export interface Moment {
  timeS: number;
  sample: Sample;
  paused: boolean;
  speed: number | null; // times real time; null: as fast as it can
}

interface Head {
  time_s: number;
  paused: boolean;
  speed: number | null;
}

const LEAST_MS = 100; // from one to the next

export class Moments {
  latest: Moment | null = null;
  // Called when one has come, and when there will be no more.
  changed: () => void = () => {};

  constructor(private readonly scene: Scene) {
    const socket = new WebSocket(new URL("moments", location.href.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    const ask = () => requestAnimationFrame(() => socket.readyState === 1 && socket.send("look"));
    socket.onopen = ask;
    socket.onmessage = (message) => {
      this.take(message.data);
      setTimeout(ask, LEAST_MS);
    };
    socket.onclose = () => {
      this.latest = null;
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
    const all = { ...pose(""), led: arrays.led as Uint8Array, objects };
    const { time_s: timeS, paused, speed } = head;
    this.latest = { timeS, sample: this.recorded(all), paused, speed };
    this.changed();
  }

  // Those that samples have too.
  private recorded(all: Sample): Sample {
    const ids = this.scene.recorded;
    if (!ids) return all;
    const chosen = <T extends Arrays[string]>(of: T) => of.filter((_, k) => wanted.has(k)) as T;
    const wanted = new Set(ids);
    const [x, y, heading, led] = [all.x, all.y, all.heading, all.led].map(chosen) as [
      Float32Array,
      Float32Array,
      Uint16Array,
      Uint8Array,
    ];
    return { x, y, heading, led, objects: all.objects };
  }
}
