// All robots as one mesh of points. The place between two samples is worked out by the graphics
// processor, so that a frame uploads nothing and a sample is uploaded once.

import * as three from "three";
import { aim, pointsOf, uniformsWith, type Uniforms } from "./points";
import type { Between, Sample } from "./samples";
import type { Scene } from "./scene";
import { rampColour } from "./values";

const LEDS = 64;
export const MARKS = 7;
// The meaning of a robot's colour.
export type Colouring = "led" | "state" | "value";

const VERTEX = `
precision highp float;
uniform float part, radius, pixel, ratio, least; // least: px, so that a robot far away is seen
uniform vec2 middle, scale;
in vec2 fromX, toX; // x, y
in float fromHeading, toHeading; // parts of a turn
in float led;
in float informed;
flat out vec2 front;
flat out float edge;
flat out int shownLed, ring;
void main() {
  vec2 place = mix(fromX, toX, part);
  if (isnan(place.x) || isnan(place.y)) {
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
    return;
  }
  float turn = fract(toHeading - fromHeading + 0.5) - 0.5;
  float heading = 6.283185307 * (fromHeading + part * turn);
  float seen = max(radius, least * pixel);
  edge = pixel / seen;
  front = vec2(cos(heading), sin(heading));
  gl_PointSize = 2.0 * 1.35 * seen / pixel * ratio;
  shownLed = int(led + 0.5);
  ring = int(informed + 0.5);
  gl_Position = vec4((place - middle) * scale, 0.0, 1.0);
}`;

// A disc in the LED's colour with a mark of its state, a line to the front that is seen on any
// colour, a ring around informed robots.
const FRAGMENT = `
precision highp float;
uniform sampler2D leds; // colour, and the mark in alpha
flat in vec2 front;
flat in float edge;
flat in int shownLed, ring;
out vec4 shown;
float stroke(float distance, float width) {
  return 1.0 - smoothstep(width - edge, width + edge, abs(distance));
}
float mark(int kind, vec2 p) {
  float r = length(p);
  if (kind == 1) return 1.0 - smoothstep(0.24 - edge, 0.24 + edge, r);
  if (kind == 2) return stroke(r - 0.38, 0.09);
  if (kind == 3) return abs(p.x) < 0.5 ? stroke(p.y, 0.12) : 0.0;
  if (kind == 4) return r < 0.55 ? max(stroke(p.x - p.y, 0.14), stroke(p.x + p.y, 0.14)) : 0.0;
  if (kind == 5) return r < 0.55 ? max(stroke(p.x, 0.11), stroke(p.y, 0.11)) : 0.0;
  if (kind == 6) return max(abs(p.x), abs(p.y)) < 0.34 ? 1.0 : 0.0;
  return 0.0;
}
void main() {
  vec2 p = 1.35 * vec2(2.0 * gl_PointCoord.x - 1.0, 1.0 - 2.0 * gl_PointCoord.y);
  vec2 at = vec2(dot(front, p), front.x * p.y - front.y * p.x);
  float r = length(at);
  if (r > 1.35) discard;
  vec4 colour = texelFetch(leds, ivec2(shownLed, 0), 0);
  if (edge > 0.28) { // a few pixels: a dot with a rim
    if (r > 1.0 && ring == 0) discard;
    vec3 dot_ = r > 0.62 ? mix(colour.rgb, vec3(0.25), 0.7) : colour.rgb;
    shown = vec4(r > 1.0 ? vec3(0.8, 0.47, 0.65) : dot_, 1.0);
    return;
  }
  float light = dot(colour.rgb, vec3(0.3, 0.59, 0.11));
  vec3 ink = light > 0.45 ? vec3(0.0) : vec3(1.0);
  vec3 seen = mix(colour.rgb, ink, mark(int(colour.a * 255.0 + 0.5), at + vec2(0.12, 0.0)));
  if (at.x > 0.3 && r < 0.95) seen = mix(seen, ink, stroke(at.y, 0.1));
  seen = mix(seen, vec3(0.25), smoothstep(0.86 - edge, 0.86 + edge, r));
  float inside = 1.0 - smoothstep(1.0 - edge, 1.0 + edge, r);
  float cover = max(inside, ring > 0 ? stroke(r - 1.17, 0.09) : 0.0);
  if (cover <= 0.01) discard;
  shown = vec4(mix(vec3(0.8, 0.47, 0.65), seen, inside), cover);
}`;

export class Robots {
  readonly mesh: three.Points;
  private readonly uniforms: Uniforms;
  private readonly attributes: Record<string, three.BufferAttribute>;
  private readonly leds: three.DataTexture;
  private shownFrom: Sample | null = null;
  private shownTo: Sample | null = null;

  constructor(
    private readonly scene: Scene,
    size: number,
    ids: Uint32Array,
  ) {
    const each = (
      array: Float32Array | Uint16Array | Uint8Array,
      width: number,
      normalized: boolean,
    ) => {
      const made = new three.BufferAttribute(array, width, normalized);
      made.setUsage(three.DynamicDrawUsage);
      return made;
    };
    this.attributes = {
      fromX: each(new Float32Array(2 * size).fill(NaN), 2, false),
      toX: each(new Float32Array(2 * size).fill(NaN), 2, false),
      fromHeading: each(new Uint16Array(size), 1, true),
      toHeading: each(new Uint16Array(size), 1, true),
      led: each(new Uint8Array(size), 1, false),
      informed: each(informedFor(scene, ids), 1, false),
    };
    this.leds = new three.DataTexture(new Uint8Array(4 * LEDS), LEDS, 1);
    this.uniforms = uniformsWith({
      radius: { value: scene.radius_m },
      least: { value: 3 },
      leds: { value: this.leds },
    });
    const shaders = { vertexShader: VERTEX, fragmentShader: FRAGMENT };
    this.mesh = pointsOf(this.attributes, size, this.uniforms, shaders, 10);
    this.colourBy("led");
  }

  // In the colours of the LEDs as they are, or of the states that they mean.
  colourBy(what: Colouring): void {
    const data = this.leds.image.data as Uint8Array;
    for (let led = 0; led < LEDS; led++) {
      const value = parseInt(colourOf(this.scene, led, what).slice(1), 16);
      const mark = what === "value" ? 0 : markOf(this.scene, led);
      data.set([value >> 16, (value >> 8) & 255, value & 255, mark], 4 * led);
    }
    this.leds.needsUpdate = true;
  }

  // `least`: a robot's radius in pixels, at least.
  view(
    middle: [number, number],
    scale: [number, number],
    pixelM: number,
    least: number,
  ): void {
    aim(this.uniforms, middle, scale, pixelM);
    this.uniforms.least.value = least;
  }

  show(between: Between): void {
    if (between.from !== this.shownFrom) {
      this.put("fromX", between.from);
      this.upload("fromHeading", between.from.heading);
      this.upload("led", between.from.led);
      this.shownFrom = between.from;
    }
    if (between.to !== this.shownTo) {
      this.put("toX", between.to);
      this.upload("toHeading", between.to.heading);
      this.shownTo = between.to;
    }
    this.uniforms.part.value = between.part;
  }

  // Where robots are, for what is drawn around them.
  get places(): Record<"fromX" | "toX", three.BufferAttribute> {
    return { fromX: this.attributes.fromX, toX: this.attributes.toX };
  }

  private put(name: string, sample: Sample): void {
    const attribute = this.attributes[name];
    const places = attribute.array as Float32Array;
    for (let k = 0; k < sample.x.length; k++) {
      places[2 * k] = sample.x[k];
      places[2 * k + 1] = sample.y[k];
    }
    attribute.needsUpdate = true;
  }

  private upload(name: string, values: Uint16Array | Uint8Array): void {
    const attribute = this.attributes[name];
    (attribute.array as Uint8Array).set(values);
    attribute.needsUpdate = true;
  }
}

// A robot's radius in pixels, at least, so that one far away is seen; less where they are many.
export function leastRadius(robots: number, pixels: number): number {
  return Math.min(3, Math.max(1, 0.4 * Math.sqrt(pixels / Math.max(1, robots))));
}

export function colourOf(scene: Scene, led: number, what: Colouring): string {
  if (what === "value") return rampColour(led);
  return what === "led" ? scene.leds[led] : scene.states.colours[scene.states.of_led[led]];
}

// The mark that tells a state without its colour; states beyond those named have none.
export function markOf(scene: Scene, led: number): number {
  const state = scene.states.of_led[led & (LEDS - 1)];
  return state < scene.states.known ? state % MARKS : 0;
}

export function informedFor(scene: Scene, ids: Uint32Array): Uint8Array {
  return Uint8Array.from(ids, (id) => {
    const range = scene.informed.find(([first, end]) => first <= id && id < end);
    return range ? range[2] : 0;
  });
}
