// Many robots of a few pixels each, painted by the processor: without a graphics card 100,000 points
// take 30 times as long.

import { colourOf, informedFor, type Colouring } from "./robots";
import { grown, type Beat } from "./messages";
import type { Between } from "./samples";
import type { Scene } from "./scene";

const LEDS = 64;
const FEW = 300;
const SMALL_PX = 3.5; // a radius at which no heading is seen
const RIM = 0xff404040;
const SENDER = 0xffb27200; // a ring around one that sends
const RING = 0xffa679cc; // of informed robots, as red, green and blue from the low byte on

// Where pixels are: those of (0, 0), and how many there are to the metre.
export interface PixelView {
  x: number;
  y: number;
  perMetre: number;
  radius: number; // of a robot as it is drawn, pixels
}

export class Dots {
  readonly canvas = document.createElement("canvas");
  private readonly colours = new Uint32Array(LEDS);
  private readonly informed: Uint8Array;
  private image: ImageData | null = null;
  private painted = false;

  constructor(
    private readonly scene: Scene,
    private readonly number: number,
    ids: Uint32Array,
  ) {
    this.canvas.className = "overlay";
    this.informed = informedFor(scene, ids);
    this.colourBy("led");
  }

  // Whether robots of that radius, in pixels, are to be painted here.
  serves(radius: number): boolean {
    return this.number > FEW && radius < SMALL_PX;
  }

  colourBy(what: Colouring): void {
    for (let led = 0; led < LEDS; led++) {
      const value = parseInt(colourOf(this.scene, led, what).slice(1), 16);
      const [red, green, blue] = [value >> 16, (value >> 8) & 255, value & 255];
      this.colours[led] = (0xff000000 | (blue << 16) | (green << 8) | red) >>> 0;
    }
  }

  resize(width: number, height: number): void {
    this.canvas.width = width;
    this.canvas.height = height;
    this.image = null;
  }

  clear(): void {
    if (this.painted) this.context().clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.painted = false;
  }

  // `sent`: how many messages of each robot are to be shown; null: none.
  paint({ from, to, part }: Between, view: PixelView, sent: Uint16Array | null, beat: Beat): void {
    const { width, height } = this.canvas;
    this.image ??= this.context().createImageData(width, height);
    const pixels = new Uint32Array(this.image.data.buffer);
    pixels.fill(0);
    const dot = stencil(view.radius, width);
    const ring = stencil(1.35 * view.radius, width);
    const edge = Math.ceil(1.35 * view.radius) + 1;
    const [fromX, fromY, toX, toY] = [from.x, from.y, to.x, to.y];
    for (let k = 0; k < this.number; k++) {
      const x = Math.floor(view.x + view.perMetre * (fromX[k] + part * (toX[k] - fromX[k])));
      const y = Math.floor(view.y - view.perMetre * (fromY[k] + part * (toY[k] - fromY[k])));
      // Not so for NaN either.
      if (!(x >= edge && x < width - edge && y >= edge && y < height - edge)) continue;
      const at = y * width + x;
      if (sent && grown(sent[k], k, part, beat) >= 0) {
        for (const offset of ring.all) pixels[at + offset] = SENDER;
      } else if (this.informed[k]) for (const offset of ring.all) pixels[at + offset] = RING;
      const colour = this.colours[from.led[k] & (LEDS - 1)];
      for (const offset of dot.all) pixels[at + offset] = colour;
      for (const offset of dot.rim) pixels[at + offset] = RIM;
    }
    this.context().putImageData(this.image, 0, 0);
    this.painted = true;
  }

  private context(): CanvasRenderingContext2D {
    return this.canvas.getContext("2d")!;
  }
}

// Offsets of a disc's pixels from its middle in a picture of that width. Small ones have no rim.
function stencil(radius: number, width: number): { all: Int32Array; rim: Int32Array } {
  const all: number[] = [];
  const rim: number[] = [];
  const reach = Math.ceil(radius);
  for (let y = -reach; y < reach; y++) {
    for (let x = -reach; x < reach; x++) {
      const away = Math.hypot(x + 0.5, y + 0.5);
      if (away > Math.max(radius, 0.71)) continue;
      all.push(y * width + x);
      if (radius > 2 && away > radius - 1) rim.push(y * width + x);
    }
  }
  return { all: Int32Array.from(all), rim: Int32Array.from(rim) };
}
