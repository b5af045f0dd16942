// The panel with all that is known of the robot, or of the cell, that was chosen.

import type { Pane } from "./pane";
import { cellRows, holding, metricRows, moduleRows, robotRows, textOf, type Row } from "./facts";
import { uidOf, type Counters, type ModuleAnswer, type RobotAnswer, type Scene } from "./scene";
import type { Source } from "./source";

const MOST_LINES = 200;

export class Inspector {
  // The robot that it shows, if it shows one.
  robot: number | null = null;
  private run = 0;
  private pane: Pane | null = null;
  private cell: { module: [number, number]; cell: number; answer: ModuleAnswer | null } | null = null;
  private metrics: RobotAnswer["metrics"] = {};
  private timeS = 0;
  // Called with a time to go to.
  chosen: (timeS: number) => void = () => {};

  constructor(
    private readonly element: HTMLElement,
    private readonly source: Source,
  ) {}

  clear(): void {
    this.robot = null;
    this.cell = null;
    this.pane = null;
    this.element.hidden = true;
  }

  // Whether it shows anything.
  get open(): boolean {
    return this.pane !== null;
  }

  async showRobot(pane: Pane, run: number, robot: number): Promise<void> {
    [this.pane, this.run, this.robot, this.cell] = [pane, run, robot, null];
    this.metrics = {};
    this.element.hidden = false;
    this.element.replaceChildren(
      element("h2", `robot ${uidOf(pane.scene, robot)}`),
      element("dl", "", { id: "now" }),
      element("p", "", { id: "hold", title: "type this to hold it here, with gdb" }),
      element("p", "its history is being read ...", { id: "history" }),
    );
    try {
      const answer = await this.source.robot(run, robot);
      if (this.robot !== robot || this.run !== run) return;
      this.metrics = answer.metrics;
      this.element.querySelector("#history")!.replaceWith(...this.history(pane.scene, answer));
      this.update(this.timeS);
    } catch (error) {
      this.element.querySelector("#history")!.textContent = String((error as Error).message);
    }
  }

  async showCell(pane: Pane, run: number, module: [number, number], cell: number): Promise<void> {
    [this.pane, this.run, this.robot] = [pane, run, null];
    const place = (this.cell = { module, cell, answer: null as ModuleAnswer | null });
    this.element.hidden = false;
    this.element.replaceChildren(
      element("h2", `module ${module[0]}-${module[1]}`),
      element("dl", "", { id: "now" }),
      element("p", "its reports are being read ...", { id: "history" }),
    );
    try {
      const answer = await this.source.module(run, module);
      if (this.cell !== place) return;
      place.answer = answer;
      this.element.querySelector("#history")!.replaceWith(...this.ofModule(answer));
      this.update(this.timeS);
    } catch (error) {
      this.element.querySelector("#history")!.textContent = String((error as Error).message);
    }
  }

  // Brings what is true now up to the time that is shown.
  update(timeS: number, modules: Map<string, Counters> = new Map()): void {
    this.timeS = timeS;
    const list = this.element.querySelector<HTMLElement>("#now");
    if (!list || !this.pane) return;
    const scene = this.pane.scene;
    if (this.cell) {
      const { module, cell, answer } = this.cell;
      const now = modules.get(module.join(",")) ?? null;
      const more = answer ? moduleRows(answer, timeS, now) : [];
      facts(list, [...cellRows(scene, module, cell, timeS), ...more]);
    } else if (this.robot !== null && this.pane.shown) {
      const place = this.pane.placeOf(this.robot);
      const rows = robotRows(scene, this.pane.shown, place, this.robot);
      facts(list, [...rows, ...metricRows(scene, this.metrics, timeS)]);
      this.element.querySelector("#hold")!.textContent = holding(scene, this.robot, timeS);
    }
  }

  private ofModule(answer: ModuleAnswer): HTMLElement[] {
    const reports = answer.reports.map(([timeS, robot, cell, state]) => {
      const uid = uidOf(this.pane!.scene, robot);
      return this.line(timeS, `robot ${uid} in cell ${cell}${state ? `, ${state}` : ""}`);
    });
    const events = answer.events.slice(-MOST_LINES).map((event) => {
      return this.line(event.time_s, textOf(event));
    });
    return [
      element("h3", `reports of robots (${answer.number})`),
      list(reports, "reports"),
      element("h3", `events and prints (${answer.events.length})`),
      list(events, "prints"),
    ];
  }

  private history(scene: Scene, answer: RobotAnswer): HTMLElement[] {
    const bar = element("div", "", { className: "bar", id: "states" });
    const end = Math.max(scene.last_s, answer.history.at(-1)?.[0] ?? 0);
    answer.history.forEach(([timeS, led], k) => {
      const until = answer.history[k + 1]?.[0] ?? end;
      const state = scene.states.of_led[led & 63];
      const part = element("span", "", {
        title: `${scene.states.names[state]} from ${timeS.toFixed(1)} s to ${until.toFixed(1)} s`,
      });
      part.style.background = scene.states.colours[state];
      part.style.width = `${(100 * (until - timeS)) / Math.max(1e-9, end - scene.first_s)}%`;
      bar.append(part);
    });
    bar.onclick = (event) => {
      const share = event.offsetX + ((event.target as HTMLElement).offsetLeft - bar.offsetLeft);
      const at = event.target === bar ? event.offsetX : share;
      this.chosen(scene.first_s + (at / bar.clientWidth) * (end - scene.first_s));
    };
    const changes = answer.history.slice(-MOST_LINES).map(([timeS, led]) => {
      const name = scene.states.names[scene.states.of_led[led & 63]];
      return this.line(timeS, name);
    });
    const events = answer.events.slice(-MOST_LINES).map((event) => {
      return this.line(event.time_s, textOf(event));
    });
    const words = answer.words.map(([timeS, type, value]) => {
      return this.line(timeS, value === null ? `message of type ${type}` : `${type}: ${value}`);
    });
    const told = [element("h3", `words of the environment (${words.length})`), list(words, "words")];
    return [
      element("h3", `states (${answer.history.length} changes)`),
      bar,
      list(changes, "changes"),
      element("h3", `events and prints (${answer.number})`),
      list(events, "prints"),
      ...(words.length ? told : []),
    ];
  }

  private line(timeS: number, text: string): HTMLElement {
    const made = element("li", "");
    const button = element("button", `${timeS.toFixed(1)} s`);
    button.onclick = () => this.chosen(timeS);
    made.append(button, ` ${text}`);
    return made;
  }
}

function list(items: HTMLElement[], id: string): HTMLElement {
  const made = element("ol", "", { id });
  made.append(...items);
  return made;
}

function facts(list: HTMLElement, rows: Row[]): void {
  list.replaceChildren(...rows.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
}

export function element(
  tag: string,
  text: string,
  properties: Record<string, string> = {},
): HTMLElement {
  return Object.assign(document.createElement(tag), { textContent: text }, properties);
}
