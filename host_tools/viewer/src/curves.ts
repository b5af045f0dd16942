// The run's curves over time, with a cursor at the time that is shown.

import uPlot from "uplot";
import type { RunEvent, Scene } from "./scene";
import type { Packed } from "./source";

// Okabe and Ito's, as figures have them.
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
// Events that are marked beside failures.
const MARKED = ["reset"];
const MOST_MARKS = 500;

// LEDs that would not be seen on a dark, or a light, page.
const TOO_PALE: Record<string, string> = { "#000000": "#808080", "#ffffff": "#b0b0b0" };

export interface Curves {
  scene: Scene;
  packed: Packed;
  events: RunEvent[];
}

export class CurvesPanel {
  private plot: uPlot | null = null;
  private hidden = new Map<string, boolean>();
  private timeS = 0;
  // The line at the time that is shown, above the curves: to move it costs less than to draw them.
  private readonly cursor = Object.assign(document.createElement("div"), { className: "now" });
  // Called with a time that was clicked.
  chosen: (timeS: number) => void = () => {};

  constructor(private readonly element: HTMLElement) {
    new ResizeObserver(() => this.fit()).observe(element);
  }

  // Draws the columns of up to two runs; those of the second are dashed.
  show(runs: Curves[]): void {
    this.plot?.series.forEach((one) => this.hidden.set(String(one.label), one.show === false));
    this.plot?.destroy();
    this.plot = null;
    const tables = runs.filter((run) => run.packed.arrays.time_s?.length);
    if (!tables.length) return;
    const series: uPlot.Series[] = [{ label: "time (s)" }];
    const joined: uPlot.AlignedData[] = [];
    tables.forEach((run, k) => {
      const { arrays } = run.packed;
      const left = (name: string) =>
        name !== "time_s" && (name !== "not_resting" || run.scene.sites.length > 0);
      const names = Object.keys(arrays).filter(left);
      names.forEach((name, n) => series.push(this.seriesOf(run.scene, names, name, n, k, tables)));
      joined.push([arrays.time_s, ...names.map((name) => withGaps(arrays[name]))] as never);
    });
    const data = joined.length > 1 ? uPlot.join(joined) : joined[0];
    const ink = getComputedStyle(this.element).color;
    const axis = { stroke: ink, grid: { stroke: "#8884" }, ticks: { stroke: "#8886" } };
    this.plot = new uPlot(
      {
        ...this.room(),
        series,
        axes: [axis, { ...axis, size: 52 }],
        scales: { x: { time: false } },
        legend: { live: true },
        cursor: { drag: { x: true, y: false }, focus: { prox: 16 } },
        hooks: {
          draw: [(plot) => this.drawMarks(plot, runs)],
          setScale: [() => this.moveCursor()],
          setSize: [() => this.moveCursor()],
        },
      },
      data,
      this.element,
    );
    this.plot.over.append(this.cursor);
    this.moveCursor();
    this.plot.over.addEventListener("click", (event) => {
      if (this.plot) this.chosen(this.plot.posToVal(event.offsetX, "x"));
    });
  }

  setTime(timeS: number): void {
    this.timeS = timeS;
    this.moveCursor();
  }

  private moveCursor(): void {
    if (!this.plot) return;
    const x = this.plot.valToPos(this.timeS, "x");
    this.cursor.style.transform = `translateX(${x - 1}px)`;
    this.cursor.hidden = !(x >= 0 && x <= this.plot.over.clientWidth);
  }

  private seriesOf(
    scene: Scene,
    names: string[],
    name: string,
    place: number,
    run: number,
    runs: Curves[],
  ): uPlot.Series {
    const led = ledOf(name);
    const text = led === null ? name : nameOfLed(scene, led);
    const label = runs.length > 1 ? `${text} ${"AB"[run]}` : text;
    const isCount = !name.startsWith("metric_");
    const anyState = names.some((one) => one.startsWith("state_"));
    const anyMetric = names.some((one) => one.startsWith("metric_"));
    // Columns of states, else of metrics, else of LEDs, are seen at first where there are many.
    const isState = name.startsWith("state_");
    const shown = isState || (!anyState && (!isCount || (led !== null && !anyMetric)));
    return {
      label,
      stroke: curveColour(scene, name) || COLOURS[place % COLOURS.length],
      width: 1.5,
      dash: run ? [6, 4] : [],
      show: !(this.hidden.get(label) ?? !shown),
      points: { show: false },
      value: (_, value) => (value === null ? "" : shortNumber(value)),
    };
  }

  private room(): { width: number; height: number } {
    const legend = 56;
    return {
      width: Math.max(200, this.element.clientWidth),
      height: Math.max(80, this.element.clientHeight - legend),
    };
  }

  private fit(): void {
    this.plot?.setSize(this.room());
  }

  private drawMarks(plot: uPlot, runs: Curves[]): void {
    const { ctx, bbox } = plot;
    const line = (timeS: number, colour: string, width: number) => {
      const x = plot.valToPos(timeS, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) return;
      ctx.fillStyle = colour;
      ctx.fillRect(x - width / 2, bbox.top, width, bbox.height);
    };
    ctx.save();
    let left = MOST_MARKS;
    for (const run of runs) {
      const marked = new Set([...MARKED, ...run.scene.failures]);
      for (const event of run.events) {
        if (marked.has(event.kind) && left-- > 0) line(event.time_s, "#d5000055", 1.5);
      }
    }
    ctx.restore();
  }
}

// The colour of a curve of robots that show something, as they are drawn; "" of any other.
export function curveColour(scene: Scene, name: string): string {
  const led = ledOf(name);
  if (led !== null) return TOO_PALE[scene.leds[led]] ?? scene.leds[led];
  const state = scene.states.names.indexOf(name.replace(/^state_/, ""));
  return name.startsWith("state_") && state >= 0 ? scene.states.colours[state] : "";
}

// The LED of a curve of robots that show it: 12 of "led_12"; null of any other.
export function ledOf(curve: string): number | null {
  const led = /^led_(\d+)$/.exec(curve);
  return led && Number(led[1]);
}

// The meaning of an LED, or its colour as programs write it.
export function nameOfLed(scene: Scene, led: number): string {
  return scene.states.names[scene.states.of_led[led]];
}

function withGaps(values: ArrayLike<number>): (number | null)[] {
  return Array.from(values, (value) => (Number.isNaN(value) ? null : value));
}

function shortNumber(value: number): string {
  return Number.isInteger(value) ? String(value) : value.toPrecision(4);
}
