// The legend: a row for each state, or colour of an LED without a meaning, with its mark, its
// curve's colour and how many robots show it; and how many robots have failed.

import { curveColour, ledOf, nameOfLed } from "./curves";
import { element } from "./inspector";
import { colourOf, markOf } from "./robots";
import type { Scene } from "./scene";

const LEDS = 64;

export class Legend {
  private readonly runs: RunLegend[];

  constructor(parent: HTMLElement, scenes: Scene[]) {
    this.runs = scenes.map((scene) => new RunLegend(scene));
    scenes.forEach((scene, run) => {
      if (scenes.length > 1) parent.append(element("h2", `${"AB"[run]}: ${scene.folder}`));
      parent.append(this.runs[run].list);
    });
  }

  // In colours of states, else of LEDs.
  colourBy(states: boolean): void {
    for (const run of this.runs) run.colourBy(states);
  }

  // Has a row for each LED that the run's curves have.
  takeCurves(run: number, names: string[]): void {
    this.runs[run].takeCurves(names);
  }

  // Counts robots by what they show; null: nothing is shown yet. `failed`: how many have by then.
  count(run: number, leds: Uint8Array | null, failed: number): void {
    this.runs[run].count(leds, failed);
  }
}

class RunLegend {
  readonly list = element("ul", "");
  private readonly rows = new Map<string, HTMLElement>(); // by the curve's name
  private byStates = false;
  private readonly counts = new Array<number>(LEDS).fill(0);
  private counted: Uint8Array | null = null;

  constructor(private readonly scene: Scene) {
    const { names, known, of_led } = scene.states;
    names.slice(0, known).forEach((name, state) => {
      this.row(`state_${name}`, name, of_led.indexOf(state));
    });
  }

  colourBy(states: boolean): void {
    this.byStates = states;
    for (const dot of this.list.querySelectorAll<HTMLElement>(".dot")) this.paint(dot);
  }

  takeCurves(curves: string[]): void {
    for (const curve of curves) {
      const led = ledOf(curve);
      if (led !== null) this.row(curve, nameOfLed(this.scene, led), led);
    }
  }

  count(leds: Uint8Array | null, failed: number): void {
    const { names, known, of_led } = this.scene.states;
    const counts = this.countsOf(leds);
    const shown = new Map<string, number>();
    counts.forEach((count, led) => {
      const named = of_led[led] < known;
      const curve = named ? `state_${names[of_led[led]]}` : `led_${led}`;
      if (count && !named) this.row(curve, nameOfLed(this.scene, led), led);
      shown.set(curve, (shown.get(curve) ?? 0) + count);
    });
    if (failed) this.row("failed", "failed", null);
    shown.set("failed", failed);
    for (const [curve, row] of this.rows) {
      row.querySelector("output")!.textContent = leds ? String(shown.get(curve) ?? 0) : "";
    }
  }

  // How many robots show each; a sample's are counted once, however many frames show it.
  private countsOf(leds: Uint8Array | null): number[] {
    if (leds !== this.counted) {
      this.counts.fill(0);
      for (const led of leds ?? []) this.counts[led & (LEDS - 1)]++;
      this.counted = leds;
    }
    return this.counts;
  }

  // The row of a curve, made when it is needed first; `led`: as its robots show it.
  private row(curve: string, name: string, led: number | null): void {
    if (this.rows.has(curve)) return;
    const mark = led === null ? 4 : markOf(this.scene, led);
    const dot = element("span", "", { className: `dot mark${mark}` });
    dot.dataset.led = led === null ? "" : String(led);
    this.paint(dot);
    const line = element("span", "", { className: "line" });
    if (led !== null) line.style.background = curveColour(this.scene, curve);
    const count = element("output", "", { className: "count" });
    const row = element("li", "");
    row.append(dot, element("span", name, { className: "name" }), line, count);
    this.rows.set(curve, row);
    this.list.append(row);
  }

  private paint(dot: HTMLElement): void {
    if (!dot.dataset.led) {
      dot.style.color = "#d50000";
      return;
    }
    const what = this.byStates ? "state" : "led";
    dot.style.background = colourOf(this.scene, Number(dot.dataset.led), what);
    dot.style.color = brightness(dot.style.background) > 0.45 ? "#000" : "#fff";
  }
}

function brightness(colour: string): number {
  const [r, g, b] = (colour.match(/\d+/g) ?? ["255", "255", "255"]).map(Number);
  return (0.3 * r + 0.59 * g + 0.11 * b) / 255;
}
