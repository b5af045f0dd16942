// The panel with all that is known of the robot, or of the cell, that was chosen.

import type { Pane } from "./pane";
import type { RobotAnswer, Scene } from "./scene";
import type { Source } from "./source";

const MOST_LINES = 200;

export class Inspector {
  private robot: number | null = null;
  private run = 0;
  private pane: Pane | null = null;
  // Called with a time to go to.
  chosen: (timeS: number) => void = () => {};

  constructor(
    private readonly element: HTMLElement,
    private readonly source: Source,
  ) {}

  clear(): void {
    this.robot = null;
    this.pane = null;
    this.element.hidden = true;
  }

  async showRobot(pane: Pane, run: number, robot: number): Promise<void> {
    [this.pane, this.run, this.robot] = [pane, run, robot];
    this.element.hidden = false;
    this.element.replaceChildren(
      element("h2", `robot ${robot + 1}`),
      element("dl", "", { id: "now" }),
      element("p", "its history is being read ...", { id: "history" }),
    );
    try {
      const answer = await this.source.robot(run, robot);
      if (this.robot !== robot || this.run !== run) return;
      this.element.querySelector("#history")!.replaceWith(...this.history(pane.scene, answer));
    } catch (error) {
      this.element.querySelector("#history")!.textContent = String((error as Error).message);
    }
  }

  showCell(pane: Pane, timeS: number, module: [number, number], cell: number): void {
    [this.pane, this.robot] = [null, null];
    this.element.hidden = false;
    const grid = pane.scene.grid!;
    const map = grid.maps.findLast(([atS]) => atS <= timeS)?.[1] ?? [];
    const [row, column] = [2 * module[1] + (cell < 2 ? 1 : 0), 2 * module[0] + (cell % 2)];
    const number = row * 2 * grid.columns + column;
    const site = map[number] ? pane.scene.sites[map[number] - 1].name : "none";
    const list = element("dl", "");
    facts(list, [
      ["cell", `${cell} (${["top left", "top right", "bottom left", "bottom right"][cell]})`],
      ["site", site],
      ["wall", grid.walls.includes(number) ? "yes" : "no"],
    ]);
    this.element.replaceChildren(element("h2", `module ${module[0]}-${module[1]}`), list);
  }

  // Brings what is true now up to the time that is shown.
  update(): void {
    const list = this.element.querySelector("#now");
    const between = this.pane?.shown;
    if (!list || !between || this.robot === null || !this.pane) return;
    const place = this.pane.placeOf(this.robot);
    const scene = this.pane.scene;
    const { from } = between;
    const led = from.led[place] & 63;
    const state = scene.states.names[scene.states.of_led[led]];
    const levels = [led & 3, (led >> 2) & 3, (led >> 4) & 3].join(", ");
    const heading = (from.heading[place] / 65536) * 360;
    const informed = scene.informed.find(([a, b]) => a <= this.robot! && this.robot! < b);
    facts(list as HTMLElement, [
      ["state", state],
      ["LED", `RGB(${levels})`],
      ["x, y", `${centimetres(from.x[place])}, ${centimetres(from.y[place])} cm`],
      ["heading", `${heading.toFixed(0)}°`],
      ...(informed ? [["informed of", scene.sites[informed[2] - 1].name] as [string, string]] : []),
    ]);
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
      return this.line(event.time_s, event.kind === "print" ? String(event.text) : event.kind);
    });
    return [
      element("h3", `states (${answer.history.length} changes)`),
      bar,
      list(changes, "changes"),
      element("h3", `events and prints (${answer.number})`),
      list(events, "prints"),
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

function centimetres(metres: number): string {
  return (100 * metres).toFixed(1);
}

function list(items: HTMLElement[], id: string): HTMLElement {
  const made = element("ol", "", { id });
  made.append(...items);
  return made;
}

function facts(list: HTMLElement, rows: [string, string][]): void {
  list.replaceChildren(...rows.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
}

export function element(
  tag: string,
  text: string,
  properties: Record<string, string> = {},
): HTMLElement {
  return Object.assign(document.createElement(tag), { textContent: text }, properties);
}
