// One list of all that happened and was printed, with a filter; a click goes there.

import { whoOf, textOf } from "./facts";
import { element } from "./inspector";
import type { RunEvent } from "./scene";
import type { Source } from "./source";

const TYPED_MS = 200;

export class LogPanel {
  // Called with the time, and the robot if there is one, of a line that was clicked.
  chosen: (timeS: number, robot: number | null) => void = () => {};
  private readonly filter = element("input", "", {
    id: "filter",
    placeholder: "words, as: robot 5 crash",
    title: "only lines with all of these words",
  }) as HTMLInputElement;
  private readonly number = element("p", "", { id: "lines" });
  private readonly list = element("ol", "", { id: "log" });
  private asked = 0;
  private timer = 0;

  constructor(
    private readonly parent: HTMLElement,
    private readonly source: Source,
  ) {
    this.filter.addEventListener("input", () => {
      clearTimeout(this.timer);
      this.timer = window.setTimeout(() => void this.read(), TYPED_MS);
    });
    parent.append(element("h2", "events and prints"), this.filter, this.number, this.list);
  }

  get open(): boolean {
    return !this.parent.hidden;
  }

  toggle(): void {
    this.parent.hidden = !this.parent.hidden;
    if (this.open) void this.read();
  }

  // Reads the lines anew, of the first run.
  async read(): Promise<void> {
    const asked = ++this.asked;
    const { number, events } = await this.source.log(0, this.filter.value);
    if (asked !== this.asked) return; // the filter has changed meanwhile
    const left = number - events.length;
    const lines = number === 1 ? "1 line" : `${number} lines`;
    this.number.textContent = lines + (left ? `, the last ${events.length} of them` : "");
    this.list.replaceChildren(...events.map((event) => this.line(event)));
  }

  private line(event: RunEvent): HTMLElement {
    const made = element("li", "");
    const button = element("button", `${event.time_s.toFixed(1)} s`);
    button.onclick = () => this.chosen(event.time_s, event.robot ?? null);
    made.append(button, ` ${whoOf(event)}${textOf(event)}`);
    return made;
  }
}
