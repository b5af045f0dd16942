// Robots coloured, and labelled, by what was recorded of each: metrics, battery, motors, messages.

import type { Between, Sample } from "./samples";

type Numbers = ArrayLike<number>;

const UNKNOWN = 0; // the colour of a robot of which nothing is known
const COLOURS = 63;
// From dark to bright, told apart by all eyes and in grey.
const RAMP = ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"];

// The columns of a sample, by the names that the page shows.
export function columnsOf({ metrics, battery, motors, messages }: Sample): Map<string, Numbers> {
  const found = new Map<string, Numbers>();
  for (const [name, values] of Object.entries(metrics ?? {})) found.set(name.slice(7), values);
  if (battery) found.set("battery", battery);
  if (motors) found.set("left motor", motors.left).set("right motor", motors.right);
  if (messages) found.set("sent", messages.sent).set("received", messages.received);
  return found;
}

export class Values {
  name: string | null = null; // of the column that is shown
  least = Infinity; // and the greatest value of it that was seen
  most = -Infinity;
  private kept = new WeakMap<Sample, Between["from"]>();

  // To the next column of the sample, after the last one to none.
  next(sample: Sample): void {
    const names = [...columnsOf(sample).keys(), null];
    this.name = names[(names.indexOf(this.name) + 1) % names.length];
    [this.least, this.most] = [Infinity, -Infinity];
    this.kept = new WeakMap();
  }

  // The value of a robot, as its label has it; "" if it is not known.
  label(sample: Sample, place: number): string {
    const value = columnsOf(sample).get(this.name ?? "")?.[place] ?? NaN;
    if (Number.isNaN(value)) return "";
    return Number.isInteger(value) ? String(value) : value.toPrecision(4);
  }

  // The same with the number of a colour in place of each LED.
  coloured(between: Between): Between {
    const values = columnsOf(between.from).get(this.name ?? "");
    if (this.name === null) return between;
    if (values && this.widen(values)) this.kept = new WeakMap();
    let from = this.kept.get(between.from);
    if (!from) {
      const led = new Uint8Array(between.from.x.length);
      if (values) for (let k = 0; k < led.length; k++) led[k] = this.colour(values[k]);
      this.kept.set(between.from, (from = { ...between.from, led }));
    }
    return { ...between, from };
  }

  private widen(values: Numbers): boolean {
    const before = [this.least, this.most];
    for (let k = 0; k < values.length; k++) {
      if (values[k] < this.least) this.least = values[k];
      if (values[k] > this.most) this.most = values[k];
    }
    return this.least !== before[0] || this.most !== before[1];
  }

  private colour(value: number): number {
    if (Number.isNaN(value)) return UNKNOWN;
    const share = (value - this.least) / (this.most - this.least || 1);
    return 1 + Math.round(share * (COLOURS - 1));
  }
}

// Colour number 0 to 63, as #rrggbb.
export function rampColour(number: number): string {
  if (number === UNKNOWN) return "#808080";
  const at = ((number - 1) / (COLOURS - 1)) * (RAMP.length - 1);
  const low = Math.min(RAMP.length - 2, Math.floor(at));
  const [from, to] = [RAMP[low], RAMP[low + 1]].map((one) => parseInt(one.slice(1), 16));
  const mixed = [16, 8, 0].map((shift) => {
    const [a, b] = [(from >> shift) & 255, (to >> shift) & 255];
    return Math.round(a + (at - low) * (b - a)).toString(16).padStart(2, "0");
  });
  return `#${mixed.join("")}`;
}
