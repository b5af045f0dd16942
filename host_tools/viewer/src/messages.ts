// Messages as they are sent: a ring around each sender that grows to the range and fades. Samples
// have counts; those of the time in between are drawn evenly spread over it.

import * as three from "three";
import { aim, pointsOf, uniformsWith, type Uniforms } from "./points";
import type { Between, Sample } from "./samples";

const LIFE_S = 0.25; // of a ring
const OF_A_MOMENT = 0.4; // how far it has grown where a moment tells that there were some

export interface Beat {
  lifeS: number;
  spanS: number; // 0: of a moment
}

// How many messages each robot has sent between the two samples; null if that is not known.
export function sentIn(between: Between): Uint16Array | null {
  const [before, after] = [between.earlier ?? between.from, between.to];
  if (!before.messages || !after.messages) return null;
  let known = kept.get(after);
  if (known?.before !== before) {
    const [from, to] = [before.messages.sent, after.messages.sent];
    const number = Uint16Array.from(to, (sent, k) => Math.min(65535, Math.max(0, sent - from[k])));
    kept.set(after, (known = { before, number }));
  }
  return known.number;
}

const kept = new WeakMap<Sample, { before: Sample; number: Uint16Array }>();

// How long a ring is seen; when time goes fast as long as at real time, as the eye has it.
export function beatOf(between: Between, speed: number): Beat {
  if (between.earlier) return { lifeS: LIFE_S, spanS: 0 };
  return { lifeS: LIFE_S * Math.max(1, speed), spanS: between.spanS ?? 0 };
}

// How far the ring of a robot has grown that sends `number` of them, 0 to 1; -1: there is none.
// The shader has it too.
export function grown(number: number, robot: number, part: number, beat: Beat): number {
  if (number < 1) return -1;
  if (!(beat.spanS > 0)) return OF_A_MOMENT;
  const apartS = beat.spanS / number;
  const at = number * part + offsetOf(robot);
  const ageS = (at - Math.floor(at)) * apartS;
  return ageS < beat.lifeS ? ageS / Math.min(beat.lifeS, apartS) : -1;
}

// Robots do not all begin at once.
function offsetOf(robot: number): number {
  return (robot * 0.618034) % 1;
}

const VERTEX = `
precision highp float;
uniform float part, life, span, radius, reach, pixel, ratio;
uniform vec2 middle, scale;
in vec2 fromX, toX;
in float number;
out float fade;
flat out float edge;
void main() {
  float apart = span / max(number, 1.0);
  float at = number * part + fract(float(gl_VertexID) * 0.618034);
  float age = fract(at) * apart;
  float grown = span > 0.0 ? age / min(life, apart) : ${OF_A_MOMENT.toFixed(2)};
  vec2 place = mix(fromX, toX, part);
  gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
  if (number < 0.5 || (span > 0.0 && age >= life) || isnan(place.x) || isnan(place.y)) return;
  float seen = max(mix(radius, reach, grown), 4.0 * pixel);
  fade = 1.0 - grown;
  edge = 1.2 * pixel / seen;
  gl_PointSize = 2.0 * (seen / pixel + 2.0) * ratio;
  gl_Position = vec4((place - middle) * scale, 0.0, 1.0);
}`;

const FRAGMENT = `
precision highp float;
in float fade;
flat in float edge;
uniform vec3 colour;
out vec4 shown;
void main() {
  float r = (1.0 + 1.7 * edge) * length(2.0 * gl_PointCoord - 1.0);
  float cover = fade * (1.0 - smoothstep(0.6 * edge, 1.6 * edge, abs(r - 1.0)));
  if (cover <= 0.01) discard;
  shown = vec4(colour, cover);
}`;

export class Rings {
  readonly mesh: three.Points;
  private readonly uniforms: Uniforms;
  private readonly number: three.BufferAttribute;
  private shown: Uint16Array | null = null;

  // `places`: the attributes fromX and toX of the robots.
  constructor(
    places: Record<"fromX" | "toX", three.BufferAttribute>,
    size: number,
    radiusM: number,
    rangeM: number,
  ) {
    this.number = new three.BufferAttribute(new Float32Array(size), 1);
    this.number.setUsage(three.DynamicDrawUsage);
    this.uniforms = uniformsWith({
      life: { value: LIFE_S },
      span: { value: 0 },
      radius: { value: radiusM },
      reach: { value: Math.max(rangeM, 1.5 * radiusM) },
      colour: { value: new three.Color("#0072b2").convertLinearToSRGB() },
    });
    const attributes = { ...places, number: this.number };
    const shaders = { vertexShader: VERTEX, fragmentShader: FRAGMENT };
    this.mesh = pointsOf(attributes, size, this.uniforms, shaders, 11);
    this.mesh.visible = false;
  }

  view(middle: [number, number], scale: [number, number], pixelM: number): void {
    aim(this.uniforms, middle, scale, pixelM);
  }

  show(number: Uint16Array | null, part: number, beat: Beat): void {
    this.mesh.visible = number !== null;
    if (number && number !== this.shown) {
      (this.number.array as Float32Array).set(number);
      this.number.needsUpdate = true;
      this.shown = number;
    }
    this.uniforms.part.value = part;
    this.uniforms.life.value = beat.lifeS;
    this.uniforms.span.value = beat.spanS;
  }
}
