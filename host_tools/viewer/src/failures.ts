// Robots that have failed, by their programs or because the experiment says so, and from when on.

import type { RunEvent, Scene } from "./scene";

const MOST_CROSSES = 3000;

export class Failures {
  private readonly kinds: Set<string>;
  private known: { timeS: number; place: number }[] = []; // in order of time

  constructor(scene: Scene) {
    this.kinds = new Set(scene.failures);
  }

  // `placeOf`: the place of a robot in a sample, below 0 if it was not recorded.
  take(events: RunEvent[], placeOf: (robot: number) => number): void {
    const first = new Map<number, number>();
    for (const { kind, robot, time_s } of events) {
      if (robot === undefined || !this.kinds.has(kind)) continue;
      first.set(robot, Math.min(time_s, first.get(robot) ?? Infinity));
    }
    this.known = [...first]
      .map(([robot, timeS]) => ({ timeS, place: placeOf(robot) }))
      .sort((a, b) => a.timeS - b.timeS);
  }

  // How many have failed by then.
  by(timeS: number): number {
    const later = this.known.findIndex((failure) => failure.timeS > timeS);
    return later < 0 ? this.known.length : later;
  }

  // Draws a red cross on each that has by then, seen on any colour; `pixelOf`: where a place is.
  draw(
    context: CanvasRenderingContext2D,
    timeS: number,
    radius: number,
    pixelOf: (place: number) => [number, number],
  ): void {
    const reach = Math.max(4, 0.8 * radius);
    context.beginPath();
    for (const { place } of this.known.slice(0, Math.min(MOST_CROSSES, this.by(timeS)))) {
      if (place < 0) continue;
      const [x, y] = pixelOf(place);
      for (const way of [-1, 1]) {
        context.moveTo(x - reach, y - way * reach);
        context.lineTo(x + reach, y + way * reach);
      }
    }
    for (const [width, colour] of [[5, "#fff"], [3, "#d50000"]] as const) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.stroke();
    }
  }
}
