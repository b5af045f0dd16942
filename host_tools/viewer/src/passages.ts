// Messages from robot to robot, as lines: those of a chain that `kilotwin why` has told, and those
// that were recorded (record.also = ["frames"]) as they pass.

import type { Passage, Scene } from "./scene";
import type { Source } from "./source";

const LIFE_S = 0.25; // of a line behind the frame's end
const PIECE_S = 2; // of recorded frames that are asked for at once
const CHAIN = "#d55e00";
const FRAME = "#0072b2";
const LEAST_HEAD = 9; // pixels of an arrow's head

export class Passages {
  private piece = -1;
  private frames: Passage[] = [];
  private readonly chain: Passage[];
  private readonly recorded: boolean;
  private readonly places: Map<number, number> | null; // in a sample, by robot

  constructor(
    scene: Scene,
    private readonly source: Source,
    private readonly run: number,
  ) {
    this.chain = scene.why?.lines ?? [];
    this.places = scene.recorded && new Map(scene.recorded.map((robot, place) => [robot, place]));
    this.recorded = scene.also.includes("frames");
  }

  // Whether there may be lines.
  any(messages: boolean): boolean {
    return this.chain.length > 0 || (messages && this.recorded);
  }

  // `pixelOf`: where a robot is, by its place in a sample. `came`: asked-for frames are there.
  draw(
    context: CanvasRenderingContext2D,
    timeS: number,
    messages: boolean,
    pixelOf: (place: number) => [number, number],
    came: () => void,
  ): void {
    const at = (robot: number): [number, number] | null => {
      const place = this.places ? this.places.get(robot) : robot;
      const pixel = place === undefined ? null : pixelOf(place);
      return pixel && Number.isFinite(pixel[0]) ? pixel : null;
    };
    if (messages && this.recorded) {
      this.ask(timeS, came);
      for (const frame of this.frames) {
        const ageS = timeS - frame.at_s;
        if (frame.begin_s > timeS || ageS > LIFE_S) continue;
        context.globalAlpha = 0.75 * (1 - Math.max(0, ageS) / LIFE_S);
        arrow(context, at(frame.from), at(frame.to), FRAME, 1.2);
      }
    }
    context.globalAlpha = 1;
    // The first message of a chain is the last of its list.
    this.chain.forEach((one, k) => {
      context.setLineDash(one.begin_s <= timeS ? [] : [5, 4]);
      const label = `${this.chain.length - k}: ${one.at_s.toFixed(2)} s`;
      arrow(context, at(one.from), at(one.to), CHAIN, 2.5, label);
    });
    context.setLineDash([]);
  }

  private async ask(timeS: number, came: () => void): Promise<void> {
    const piece = Math.floor(timeS / PIECE_S);
    if (piece === this.piece) return;
    this.piece = piece;
    const fromS = piece * PIECE_S - LIFE_S;
    const frames = await this.source.frames(this.run, fromS, (piece + 1) * PIECE_S).catch(() => []);
    if (this.piece !== piece) return;
    this.frames = frames;
    came();
  }
}

function arrow(
  context: CanvasRenderingContext2D,
  from: [number, number] | null,
  to: [number, number] | null,
  colour: string,
  width: number,
  label = "",
): void {
  if (!from || !to) return;
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(dx, dy) || 1;
  const head = Math.min(LEAST_HEAD, length / 2);
  const [ux, uy] = [(dx / length) * head, (dy / length) * head];
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.moveTo(to[0] - ux - uy / 2, to[1] - uy + ux / 2);
  context.lineTo(...to);
  context.lineTo(to[0] - ux + uy / 2, to[1] - uy - ux / 2);
  context.stroke();
  if (!label) return;
  context.font = "bold 12px system-ui, sans-serif";
  context.textAlign = "center";
  context.lineWidth = 3;
  context.setLineDash([]);
  context.strokeStyle = "#ffffffd0";
  const middle: [number, number] = [from[0] + dx / 2, from[1] + dy / 2 - 6];
  context.strokeText(label, ...middle);
  context.fillStyle = colour;
  context.fillText(label, ...middle);
}
