// Steering of a run that goes on in the server's hands: its pace, robots put elsewhere, commands and
// parameters. Each is one request; the answer says whether it was done.

import type { Moment } from "./live";

// The orders that the run takes; null: none.
export interface Offers {
  grid: boolean;
  commands: string[];
  parameters: Record<string, unknown>;
}

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, null];
const SAID_MS = 6000;
const OVER = "is over; ▶ plays what it recorded, the slider goes to any time of it";
const GONE = "the run is over; robots can be moved while it goes: start it again with --view";

export class SteeringBar {
  readonly element = element("div", "", { id: "steering" });
  // Whether a robot that is dragged is put elsewhere.
  moves = false;
  // Called when something was done, or refused.
  changed: () => void = () => {};
  private readonly hold = this.button("❚❚", "pause the run (P)", () => this.toggle());
  private readonly speed = element("output", "", { title: "how fast the run goes" });
  private readonly said = element("output", "", { id: "said" });
  private readonly mover = this.button("move", "drag robots elsewhere; with Shift they turn (M)", () => this.toggleMoves());
  private paused = false;
  private speedNow: number | null = null;
  private saidAt = 0;
  private over = false;

  constructor(offers: Offers) {
    this.hold.id = "hold";
    this.element.append(
      element("strong", "run"),
      this.hold,
      this.button("tick", "a tick on (>)", () => this.stepTick()),
      this.button("sample", "to the next sample (S)", () => this.stepSample()),
      this.button("−", "slower (()", () => this.faster(-1)),
      this.speed,
      this.button("+", "faster ())", () => this.faster(1)),
      this.mover,
    );
    this.mover.id = "mover";
    if (offers.grid) {
      for (const order of ["pause", "resume"]) {
        const text = `grid: ${order}`;
        this.element.append(
          this.button(text, `the grid's host: ${order}`, () => this.ask({ do: "grid", order })),
        );
      }
    }
    if (offers.commands.length) this.element.append(this.commands(offers.commands));
    if (Object.keys(offers.parameters).length) {
      this.element.append(this.parameters(offers.parameters));
    }
    this.element.append(this.said);
  }

  // Shows the pace that a moment tells of.
  show(moment: Moment): void {
    this.paused = moment.paused;
    this.speedNow = moment.speed;
    this.hold.textContent = moment.paused ? "▶" : "❚❚";
    this.hold.classList.toggle("on", moment.paused);
    this.speed.textContent = moment.speed === null ? "max" : `${moment.speed}×`;
    if (performance.now() - this.saidAt > SAID_MS) this.said.textContent = "";
  }

  // The run is over: from now on `again` plays what it has recorded.
  end(again: () => void): void {
    if (this.over) return;
    this.over = true;
    if (this.moves) this.toggleMoves();
    this.element.replaceChildren(
      element("strong", "run"),
      element("span", OVER),
      this.button("▶ again", "play the record from its start", again),
      this.said,
    );
  }

  toggle(): void {
    void this.ask({ do: this.paused ? "resume" : "pause" });
  }

  stepTick(): void {
    void this.ask({ do: "step", ticks: 1 });
  }

  stepSample(): void {
    void this.ask({ do: "step" });
  }

  faster(by: number): void {
    const at = SPEEDS.findIndex((speed) => speed === null || speed >= (this.speedNow ?? Infinity));
    const speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + by))];
    void this.ask({ do: "speed", ...(speed === null ? {} : { speed }) });
  }

  toggleMoves(): void {
    if (this.over && !this.moves) return this.say(GONE);
    this.moves = !this.moves;
    this.mover.classList.toggle("on", this.moves);
    this.changed();
  }

  place(robot: number, x_m: number, y_m: number): void {
    void this.ask({ do: "place", robot, x_m, y_m });
  }

  turn(robot: number, heading_rad: number): void {
    void this.ask({ do: "turn", robot, heading_rad });
  }

  private async ask(order: Record<string, unknown>): Promise<void> {
    if (this.over) return this.say(GONE);
    const headers = { "Content-Type": "application/json" };
    let text = "";
    try {
      const answer = await fetch("steer", { method: "POST", headers, body: JSON.stringify(order) });
      if (!answer.ok) text = (await answer.text()).trim();
    } catch {
      text = "the viewer is gone";
    }
    this.say(text);
  }

  private say(text: string): void {
    this.saidAt = performance.now();
    this.said.textContent = text;
    this.said.title = text;
    this.changed();
  }

  // A message of the overhead controller, to all robots or one.
  private commands(names: string[]): HTMLElement {
    const form = element("form", "");
    const send = element("select", "", { title: "a message of the overhead controller" });
    send.append(...names.map((name) => element("option", name, { value: name })));
    const more = element("input", "", {
      size: 18,
      placeholder: "robot = 3, type = 5, data = [1]",
      title: "more keys of a [[command]], as in an experiment; without any it is for all robots",
    });
    const button = element("button", "send", { title: "send it now" });
    form.append(send, more, button);
    form.onsubmit = (event) => {
      event.preventDefault();
      const keys = keysOf(more.value);
      if (keys) void this.ask({ do: "command", keys: { send: send.value, ...keys } });
      else this.said.textContent = `${more.value}: write key = value, ...`;
    };
    return form;
  }

  private parameters(values: Record<string, unknown>): HTMLElement {
    const form = element("form", "");
    const list = element("datalist", "", { id: "parameters" });
    for (const [key, value] of Object.entries(values)) {
      list.append(element("option", "", { value: `${key}=${JSON.stringify(value)}` }));
    }
    const setting = element("input", "", {
      size: 24,
      placeholder: Object.keys(values)[0] + "=...",
      title: "a parameter and its new value, which all robots are told",
    });
    setting.setAttribute("list", "parameters");
    form.append(setting, list, element("button", "set", { title: "tell robots now" }));
    form.onsubmit = (event) => {
      event.preventDefault();
      void this.ask({ do: "set", setting: setting.value });
    };
    return form;
  }

  private button(text: string, title: string, act: () => unknown): HTMLButtonElement {
    const made = element("button", text, { title });
    made.onclick = () => void act();
    return made;
  }
}

function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  text: string,
  properties: Record<string, string | number> = {},
): HTMLElementTagNameMap[K] {
  return Object.assign(document.createElement(tag), { textContent: text }, properties);
}

// {robot: 3, data: [1, 2]} of "robot = 3, data = [1, 2]"; null of what is none.
export function keysOf(text: string): Record<string, unknown> | null {
  const keys: Record<string, unknown> = {};
  for (const part of text.split(/,(?![^[]*\])/)) {
    if (!part.trim()) continue;
    const [, key, value] = /^\s*(\w+)\s*=\s*(.+?)\s*$/.exec(part) ?? [];
    if (key === undefined) return null;
    try {
      keys[key] = JSON.parse(value);
    } catch {
      keys[key] = value;
    }
  }
  return keys;
}
