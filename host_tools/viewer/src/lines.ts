// Lines that are worked out from samples: trails, and pairs of robots within reach of each other.

import type { Sample } from "./samples";

// Trails behind robots: pairs of points, the oldest samples first. All of them, or those chosen.
export function trails(samples: Sample[], chosen: number[] | null): Float32Array {
  const points: number[] = [];
  for (let k = 1; k < samples.length; k++) {
    const [a, b] = [samples[k - 1], samples[k]];
    const number = chosen ? chosen.length : a.x.length;
    for (let n = 0; n < number; n++) {
      const i = chosen ? chosen[n] : n;
      if (b.x[i] !== a.x[i] || b.y[i] !== a.y[i]) {
        points.push(a.x[i], a.y[i], 0, b.x[i], b.y[i], 0);
      }
    }
  }
  return new Float32Array(points);
}

// Pairs of robots no farther apart than `rangeM`; at most `most` pairs.
export function links(sample: Sample, rangeM: number, most: number): Float32Array {
  const bins = new Map<string, number[]>();
  const bin = (value: number) => Math.floor(value / rangeM);
  const points: number[] = [];
  for (let i = 0; i < sample.x.length; i++) {
    const [x, y] = [sample.x[i], sample.y[i]];
    if (Number.isNaN(x)) continue;
    for (let dx = -1; dx <= 1; dx++) {
      for (let dy = -1; dy <= 1; dy++) {
        for (const j of bins.get(`${bin(x) + dx},${bin(y) + dy}`) ?? []) {
          if (Math.hypot(sample.x[j] - x, sample.y[j] - y) <= rangeM) {
            points.push(x, y, 0, sample.x[j], sample.y[j], 0);
            if (points.length >= 6 * most) return new Float32Array(points);
          }
        }
      }
    }
    const key = `${bin(x)},${bin(y)}`;
    const there = bins.get(key);
    if (there) there.push(i);
    else bins.set(key, [i]);
  }
  return new Float32Array(points);
}
