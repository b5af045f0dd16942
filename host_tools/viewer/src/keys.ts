// Keys and their actions.

export interface Actions {
  play(): void;
  sampleBack(): void;
  sampleOn(): void;
  tickBack(): void;
  tickOn(): void;
  begin(): void;
  end(): void;
  faster(): void;
  slower(): void;
  nextEvent(): void;
  lastEvent(): void;
  trails(): void;
  links(): void;
  messages(): void;
  cells(): void;
  floor(): void;
  light(): void;
  reports(): void;
  uids(): void;
  events(): void;
  follow(): void;
  picture(): void;
  clip(): void;
  tape(): void;
  poses(): void;
  states(): void;
  values(): void;
  closer(): void;
  farther(): void;
  left(): void;
  right(): void;
  up(): void;
  down(): void;
  fit(): void;
  holdRun(): void;
  stepTick(): void;
  stepSample(): void;
  slowRun(): void;
  fastRun(): void;
  moveRobots(): void;
  nextRobot(): void;
  lastRobot(): void;
  dark(): void;
  help(): void;
  close(): void;
}

// As shown, as the browser names them (with Shift+ in front), and what they do.
export const KEYS: [string, Partial<Record<string, keyof Actions>>, string][] = [
  ["space", { " ": "play" }, "play, pause"],
  ["← →", { ArrowLeft: "sampleBack", ArrowRight: "sampleOn" }, "a sample back, on"],
  [", .", { ",": "tickBack", ".": "tickOn" }, "a tick back, on"],
  ["Home End", { Home: "begin", End: "end" }, "to the begin, to the end (and stay there)"],
  ["↓ ↑", { ArrowDown: "slower", ArrowUp: "faster" }, "slower, faster"],
  ["p n", { p: "lastEvent", n: "nextEvent" }, "to the event before, to the next one"],
  [
    "j k",
    { j: "lastRobot", k: "nextRobot", "[": "lastRobot", "]": "nextRobot" },
    "choose the robot before, the next one; also [ ]",
  ],
  ["o", { o: "follow" }, "the chosen robot stays in the middle, or not"],
  ["c", { c: "picture" }, "save the picture, as PNG"],
  ["v", { v: "clip" }, "record what is shown as a video, WebM; again: end and save it"],
  ["w", { w: "tape" }, "measuring tape: click two places or robots; or not"],
  ["x", { x: "poses" }, "save where robots are, for poses = of an experiment"],
  ["e", { e: "events" }, "all events and prints, with a filter"],
  ["s", { s: "states" }, "colours of LEDs, or of states"],
  ["a", { a: "values" }, "colours and labels of a metric, or of what was recorded besides; the next"],
  ["t", { t: "trails" }, "trails"],
  ["l", { l: "links" }, "who is within reach of whom"],
  ["m", { m: "messages" }, "messages as they are sent, where that is known"],
  ["u", { u: "uids" }, "uids"],
  ["g", { g: "cells" }, "cells of a Kilogrid"],
  ["b i", { b: "floor", i: "light" }, "sites on the floor; lamps' and projectors' light"],
  ["r", { r: "reports" }, "where a grid's host heard robots last"],
  ["+ -", { "+": "closer", "=": "closer", "-": "farther" }, "zoom; also the wheel, or two fingers"],
  [
    "Shift ← → ↑ ↓",
    {
      "Shift+ArrowLeft": "left",
      "Shift+ArrowRight": "right",
      "Shift+ArrowUp": "up",
      "Shift+ArrowDown": "down",
    },
    "move the view; also by dragging",
  ],
  ["P", { P: "holdRun" }, "a run that goes on here: pause it, let it go on"],
  ["> S", { ">": "stepTick", S: "stepSample" }, "let it go on by a tick, to the next sample"],
  [
    "( )",
    { "(": "slowRun", ")": "fastRun", "{": "slowRun", "}": "fastRun" },
    "let it go slower, faster; also { }",
  ],
  ["M", { M: "moveRobots" }, "drag its robots elsewhere, with Shift turn them, or not"],
  ["f", { f: "fit" }, "all of the table; also a double click"],
  ["d", { d: "dark" }, "dark, light"],
  ["?", { "?": "help" }, "this list"],
  ["Esc", { Escape: "close" }, "choose nothing, close"],
];

export function listen(actions: Actions): void {
  const meaning = new Map<string, keyof Actions>();
  for (const [, keys] of KEYS) {
    for (const [key, action] of Object.entries(keys)) meaning.set(key, action!);
  }
  document.addEventListener("keydown", (event) => {
    const { target } = event;
    const typing =
      (target instanceof HTMLInputElement && target.type !== "range") ||
      target instanceof HTMLSelectElement;
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const shifted = event.shiftKey ? meaning.get(`Shift+${event.key}`) : undefined;
    const action = shifted ?? meaning.get(event.key);
    if (!action) return;
    event.preventDefault();
    actions[action]();
  });
}
