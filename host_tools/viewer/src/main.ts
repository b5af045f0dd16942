// The page: makes its parts, gives keys and buttons their meaning, and draws frames.

import { Clip } from "./clip";
import { Clock } from "./clock";
import { CurvesPanel, type Curves } from "./curves";
import { Exported } from "./exported";
import { element, Inspector } from "./inspector";
import { Legend } from "./legend";
import { hashOf, linkOf } from "./link";
import { LogPanel } from "./log";
import { KEYS, listen, type Actions } from "./keys";
import { showBuses } from "./bus";
import { Moments, type Moment } from "./live";
import { posesOf } from "./poses";
import { SteeringBar } from "./steering";
import { Pane, type Layers, type Picked } from "./pane";
import { robotOf, uidOf, type RunEvent, type RunState, type Scene } from "./scene";
import { Server, type Source } from "./source";

const RUNNING = "running";
// Samples a second that are looked at, at most; of faster play every so many-th is.
const MOST_SAMPLES_S = 40;
const CURVES_AGAIN_MS = 2000;
const ALL_MESSAGES = 3000; // robots whose messages are shown unasked

class Page {
  private readonly clock = new Clock();
  private readonly curves: CurvesPanel;
  private readonly legend: Legend;
  private readonly inspector: Inspector;
  private readonly log: LogPanel;
  private readonly layers: Layers = {
    trails: false,
    links: false,
    messages: true,
    cells: true,
    floor: true,
    light: false,
    reports: false,
    uids: false,
    states: false,
  };
  private events: RunEvent[] = [];
  private drawnCurves: Curves[] = [];
  private dirty = true;
  private lastFrame = performance.now();
  private frames = 0;
  private curvesAt = 0;
  private told: RunState[] | null = null; // the newest state, while one is taken in
  private readonly moments: Moments | null;
  private clip: Clip | null = null;
  private steering: SteeringBar | null = null;

  constructor(
    private readonly source: Source,
    private readonly scenes: Scene[],
    private readonly panes: Pane[],
  ) {
    this.curves = new CurvesPanel(byId("curves"));
    this.legend = new Legend(byId("legend"), scenes);
    this.inspector = new Inspector(byId("inspector"), source);
    this.log = new LogPanel(byId("events"), source);
    this.log.chosen = (timeS, robot) => {
      this.go(timeS);
      if (robot !== null && panes[0].placeOf(robot) >= 0) this.pick(panes[0], 0, { robot });
    };
    this.curves.chosen = this.inspector.chosen = (timeS) => this.go(timeS);
    this.clock.changed = () => (this.dirty = true);
    byId("panes").append(...panes.map((pane) => pane.element));
    panes.forEach((pane, run) => {
      pane.dirty = () => (this.dirty = true);
      pane.picked = (what) => this.pick(pane, run, what);
      pane.viewMoved = (moved) => this.moveAlike(moved);
      pane.element.dataset.name = scenes.length > 1 ? `${"AB"[run]}: ${scenes[run].folder}` : "";
    });
    this.moments = scenes[0].moments ? new Moments(scenes[0]) : null;
    if (this.moments) this.moments.changed = () => this.takeMoment();
    if (scenes[0].buses) void showBuses(byId("buses"));
    if (this.moments && scenes[0].steers) this.addSteering(new SteeringBar(scenes[0].steers));
    this.setUp();
    window.addEventListener("redraw", () => (this.dirty = true));
  }

  async start(): Promise<void> {
    await Promise.all(this.panes.map((pane) => pane.samples.extend()));
    const first = Math.min(...this.scenes.map((scene) => scene.first_s));
    const last = this.lastSampleS();
    this.clock.setRange(first, last, Math.max(...this.scenes.map((scene) => scene.duration_s)));
    if (this.scenes.some((scene) => scene.status === RUNNING)) {
      this.clock.following = true;
      this.clock.go(last);
    }
    this.heedLink();
    window.addEventListener("hashchange", () => this.heedLink());
    await this.readCurves();
    if (this.source.live) this.source.watch((states) => this.heed(states));
    requestAnimationFrame((now) => this.frame(now));
  }

  // Goes to the moment, and chooses the robot, that the page's address names.
  private heedLink(): void {
    const { timeS, robot: uid } = linkOf(location.hash);
    if (timeS !== null) this.go(timeS);
    if (uid === null) return;
    const robot = robotOf(this.scenes[0], uid);
    if (this.panes[0].placeOf(robot) >= 0) this.pick(this.panes[0], 0, { robot });
  }

  // The page's address names what is shown, to be sent or kept.
  private nameInLink(): void {
    const timeS = this.clock.following ? null : this.clock.timeS;
    const robot = this.inspector.robot;
    const uid = robot === null ? null : uidOf(this.scenes[0], robot);
    const hash = hashOf({ timeS, robot: uid });
    if (hash !== location.hash) history.replaceState(null, "", hash || location.pathname);
  }

  private savePicture(): void {
    this.panes[0].picture().toBlob((data) => data && this.save(data, "png"));
  }

  // Hands a file to the browser, which writes over none; its name says the run and the time.
  private save(data: Blob, suffix: string): string {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(data);
    link.download = `${this.scenes[0].folder}-${this.clock.timeS.toFixed(1)}s.${suffix}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    return link.download;
  }

  private savePoses(): void {
    const from = this.panes[0].shown?.from;
    if (!from) return;
    const name = this.save(new Blob([posesOf(from)], { type: "text/csv" }), "csv");
    const said = byId("saved");
    said.textContent = `Beside the experiment, under [[robots]]: poses = "${name}"`;
    said.hidden = false;
  }

  private toggleClip(): void {
    const pane = this.panes[0];
    const button = document.querySelector('[data-action="clip"]');
    button?.classList.toggle("on", !this.clip);
    if (this.clip) this.clip.end();
    this.clip = this.clip
      ? null
      : new Clip((canvas) => pane.picture(canvas), (video) => this.save(video, "webm"));
  }

  private addSteering(bar: SteeringBar): void {
    this.steering = bar;
    byId("player").before(bar.element);
    bar.changed = () => {
      this.panes[0].grabs = bar.moves;
      if (bar.moves) this.goToEnd();
      this.dirty = true;
    };
    this.panes[0].dropped = (robot, x, y) => bar.place(robot, x, y);
    this.panes[0].turned = (robot, headingRad) => bar.turn(robot, headingRad);
  }

  // The moment, unless a sample is newer.
  private newest(): Moment | null {
    const latest = this.moments?.latest ?? null;
    return latest && latest.timeS >= (this.panes[0].samples.times.at(-1) ?? 0) - 1e-6 ? latest : null;
  }

  private takeMoment(): void {
    const latest = this.moments?.latest;
    if (latest && this.clock.following) this.clock.extend(latest.timeS);
    if (latest) this.steering?.show(latest);
    if (this.moments?.over) this.steering?.end(() => this.playAgain());
    if (this.steering) this.steering.element.hidden = !latest && !this.moments?.over;
    this.dirty = true;
  }

  private setUp(): void {
    const scrub = byId<HTMLInputElement>("scrub");
    scrub.addEventListener("input", () => {
      const { firstS, lastS } = this.clock;
      this.go(firstS + (Number(scrub.value) / 10_000) * (lastS - firstS));
    });
    const time = byId<HTMLInputElement>("time");
    time.addEventListener("change", () => {
      if (Number.isFinite(Number(time.value))) this.go(Number(time.value));
      time.blur();
    });
    const actions = this.actions();
    for (const button of document.querySelectorAll<HTMLButtonElement>("button[data-action]")) {
      button.onclick = () => actions[button.dataset.action as keyof Actions]();
    }
    listen(actions);
    const tellsMessages = ({ moments, also }: Scene) => moments || also.includes("messages") || also.includes("frames");
    hideUnless("messages", this.scenes.some(tellsMessages));
    // Many robots have it only if it is asked for: rings hide them, and each look costs more.
    if (this.scenes.some((scene) => scene.robots > ALL_MESSAGES)) this.actions().messages();
    const valued = ({ also, metrics }: Scene) => also.length || Object.keys(metrics).length;
    hideUnless("values", this.scenes.some(valued));
    hideUnless("light", this.scenes.some((scene) => scene.light));
    for (const name of ["cells", "reports"]) hideUnless(name, this.scenes.some((one) => one.grid));
    const help = byId("keys");
    for (const [keys, , text] of KEYS) help.append(element("dt", keys), element("dd", text));
  }

  private actions(): Actions {
    const toggle = (name: keyof Layers) => () => {
      this.layers[name] = !this.layers[name];
      document.querySelector(`[data-action="${name}"]`)?.classList.toggle("on", this.layers[name]);
      this.dirty = true;
    };
    const pane = this.panes[0];
    const stepPixels = (dx: number, dy: number) => () => {
      const metres = this.scenes[0].radius_m * 4;
      pane.pan(dx * metres, dy * metres);
    };
    return {
      play: () => {
        this.clock.toggle();
        if (!this.clock.playing) this.nameInLink();
      },
      sampleBack: () => this.step(-1),
      sampleOn: () => this.step(1),
      tickBack: () => this.go(this.clock.timeS - this.scenes[0].tick_s),
      tickOn: () => this.go(this.clock.timeS + this.scenes[0].tick_s),
      begin: () => this.go(this.clock.firstS),
      end: () => this.goToEnd(),
      faster: () => this.clock.faster(1),
      slower: () => this.clock.faster(-1),
      nextEvent: () => this.goToEvent(1),
      lastEvent: () => this.goToEvent(-1),
      trails: toggle("trails"),
      links: toggle("links"),
      messages: toggle("messages"),
      cells: toggle("cells"),
      floor: toggle("floor"),
      light: toggle("light"),
      reports: toggle("reports"),
      uids: toggle("uids"),
      states: () => {
        toggle("states")();
        this.colourRobots();
        this.legend.colourBy(this.layers.states);
      },
      values: () => {
        for (const one of this.panes) if (one.shown) one.values.next(one.shown.from);
        const on = this.panes.some((one) => one.values.name !== null);
        document.querySelector('[data-action="values"]')?.classList.toggle("on", on);
        this.colourRobots();
      },
      events: () => {
        this.log.toggle();
        document.querySelector('[data-action="events"]')?.classList.toggle("on", this.log.open);
      },
      follow: () => {
        pane.follows = !pane.follows;
        document.querySelector('[data-action="follow"]')?.classList.toggle("on", pane.follows);
        this.dirty = true;
      },
      picture: () => this.savePicture(),
      clip: () => this.toggleClip(),
      tape: () => {
        pane.tape.toggle();
        document.querySelector('[data-action="tape"]')?.classList.toggle("on", pane.tape.on);
        pane.redraw();
      },
      poses: () => this.savePoses(),
      closer: () => pane.zoom(1.25),
      farther: () => pane.zoom(0.8),
      left: stepPixels(-1, 0),
      right: stepPixels(1, 0),
      up: stepPixels(0, 1),
      down: stepPixels(0, -1),
      fit: () => pane.fit(),
      holdRun: () => this.steering?.toggle(),
      stepTick: () => this.steering?.stepTick(),
      stepSample: () => this.steering?.stepSample(),
      slowRun: () => this.steering?.faster(-1),
      fastRun: () => this.steering?.faster(1),
      moveRobots: () => this.steering?.toggleMoves(),
      nextRobot: () => this.chooseRobot(1),
      lastRobot: () => this.chooseRobot(-1),
      dark: () => {
        const root = document.documentElement;
        const preferred = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
        root.dataset.theme = (root.dataset.theme ?? preferred) === "dark" ? "light" : "dark";
        this.curves.show(this.drawnCurves);
        this.dirty = true;
      },
      help: () => byId("help").toggleAttribute("hidden"),
      close: () => {
        byId("help").hidden = byId("saved").hidden = true;
        this.panes.forEach((one) => one.select(null));
        this.inspector.clear();
        this.nameInLink();
      },
    };
  }

  private colourRobots(): void {
    for (const pane of this.panes) {
      pane.colourBy(pane.values.name !== null ? "value" : this.layers.states ? "state" : "led");
    }
  }

  // The scale of colours where they are of values.
  private tellValues(): void {
    const told = this.panes.flatMap(({ values: { name, least, most } }) => {
      if (name === null) return [];
      return `${name}: ${least <= most ? `${least} (dark) to ${most} (bright)` : "not known"}`;
    });
    byId("values").textContent = told.join(" | ");
    byId("values").hidden = !told.length;
  }

  // Runs on tables of one shape are seen from the same place.
  private moveAlike(moved: Pane): void {
    const table = JSON.stringify(moved.scene.arena);
    for (const pane of this.panes) {
      if (pane !== moved && JSON.stringify(pane.scene.arena) === table) pane.follow(moved);
    }
  }

  private go(timeS: number): void {
    this.clock.playing = false;
    this.clock.following = false;
    this.clock.go(timeS);
    this.nameInLink();
  }

  private goToEnd(): void {
    this.go(this.clock.lastS);
    this.clock.following = this.scenes.some((scene) => scene.status === RUNNING);
  }

  private playAgain(): void {
    this.go(this.clock.firstS);
    this.clock.toggle();
  }

  // To the sample before or after the time that is shown.
  private step(by: number): void {
    const { samples } = this.panes[0];
    if (!samples.count) return;
    const now = samples.at(this.clock.timeS);
    const exact = samples.times[now] === this.clock.timeS;
    const next = by > 0 || exact ? now + by : now;
    this.go(samples.times[Math.min(samples.count - 1, Math.max(0, next))]);
  }

  private goToEvent(by: number): void {
    const times = [...new Set(this.events.map((event) => event.time_s))].sort((a, b) => a - b);
    const now = this.clock.timeS;
    const to =
      by > 0 ? times.find((time) => time > now + 1e-6) : times.findLast((time) => time < now - 1e-6);
    if (to !== undefined) this.go(to);
  }

  private chosen = -1;

  private chooseRobot(by: number): void {
    const pane = this.panes[0];
    const number = this.scenes[0].recorded?.length ?? this.scenes[0].robots;
    this.chosen = (this.chosen + by + number) % number;
    this.pick(pane, 0, { robot: pane.idOf(this.chosen) });
  }

  private pick(pane: Pane, run: number, what: Picked): void {
    if (what === null) {
      this.inspector.clear();
      this.panes.forEach((one) => one.select(null));
    } else if ("robot" in what) {
      this.chosen = pane.placeOf(what.robot);
      this.panes.forEach((one) => one.select(what.robot));
      this.inspector.showRobot(pane, run, what.robot);
    } else {
      this.panes.forEach((one) => one.select(null));
      this.inspector.showCell(pane, run, what.module, what.cell);
    }
    if (!this.clock.playing) this.nameInLink();
  }

  // When the newest sample that is here was taken, of all runs.
  private lastSampleS(): number {
    return Math.max(...this.panes.map((pane) => pane.samples.times.at(-1) ?? 0));
  }

  // One state after the other: of those that come while one is taken in, the newest.
  private async heed(states: RunState[] | null): Promise<void> {
    byId("gone").hidden = states !== null;
    const busy = this.told !== null;
    if (states) this.told = states;
    if (busy) return;
    try {
      while (this.told) {
        const taken: RunState[] = this.told;
        await this.takeState(taken);
        if (this.told === taken) this.told = null;
      }
    } finally {
      this.told = null;
    }
  }

  private async takeState(states: RunState[]): Promise<void> {
    states.forEach((state, run) => Object.assign(this.scenes[run], state));
    const grown = states.map((state, run) => state.samples > this.panes[run].samples.count);
    await Promise.all(this.panes.map((pane, run) => grown[run] && pane.samples.extend()));
    // The server may have answered with more samples than this state is told of.
    this.clock.extend(this.lastSampleS());
    const ended = states.every((state) => state.status !== RUNNING);
    if (ended || performance.now() - this.curvesAt > CURVES_AGAIN_MS) await this.readCurves();
    this.drawStatus();
    this.dirty = true;
  }

  private async readCurves(): Promise<void> {
    this.curvesAt = performance.now();
    this.drawnCurves = await Promise.all(
      this.scenes.map(async (scene, run) => {
        const [packed, said] = await Promise.all([
          this.source.series(run),
          this.source.events(run),
        ]);
        return { scene, packed, events: said.events };
      }),
    );
    this.events = this.drawnCurves.flatMap((run) => run.events);
    this.drawnCurves.forEach(({ events, packed }, run) => {
      const pane = this.panes[run];
      pane.failures.take(events, (robot) => pane.placeOf(robot));
      this.legend.takeCurves(run, Object.keys(packed.arrays));
    });
    this.dirty = true;
    this.curves.show(this.drawnCurves);
    if (this.log.open) void this.log.read();
    this.drawStatus();
  }

  private drawStatus(): void {
    const texts = this.scenes.map((scene, run) => {
      const events = this.drawnCurves[run]?.events.length ?? 0;
      const number = events ? `, ${events} event${events === 1 ? "" : "s"}` : "";
      const which = this.scenes.length > 1 ? `${"AB"[run]}: ` : "";
      const of = `${which}${scene.name}, seed ${scene.seed}, ${scene.robots} robots`;
      return `${of}: ${scene.status}${number}`;
    });
    byId("title").textContent = texts.join(" | ");
    const coarse = this.scenes.map((scene) => scene.coarse).filter(Boolean);
    byId("coarse").textContent = coarse.join("; ");
    byId("coarse").hidden = !coarse.length;
  }

  private count(): void {
    this.panes.forEach((pane, run) => {
      this.legend.count(run, pane.shown?.from.led ?? null, pane.failures.by(this.clock.timeS));
    });
  }

  private frame(now: number): void {
    const seconds = Math.min(0.25, (now - this.lastFrame) / 1000);
    this.lastFrame = now;
    this.clock.advance(seconds);
    if (this.dirty) {
      this.dirty = false;
      const latest = this.clock.following ? this.newest() : null;
      if (this.moments) this.moments.closely = this.layers.messages || this.inspector.open;
      this.panes[0].showMoment(latest);
      const speed = this.clock.playing ? this.clock.speed : 1;
      const whole = this.panes.map((pane) =>
        pane.draw(this.clock.timeS, this.strideOf(pane), this.layers, speed),
      );
      this.clip?.draw();
      this.tellValues();
      this.drawTime();
      document.body.dataset.shown = whole.every(Boolean) ? this.clock.timeS.toFixed(3) : "waiting";
      document.body.dataset.frames = String(++this.frames);
      if (!whole.every(Boolean)) setTimeout(() => (this.dirty = true), 100);
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  // Every how many-th sample is drawn: all, unless play is too fast for that. A power of two.
  private strideOf(pane: Pane): number {
    const { count, times } = pane.samples;
    if (!this.clock.playing || count < 2) return 1;
    const perSecond = (this.clock.speed * (count - 1)) / (times[count - 1] - times[0]);
    return 2 ** Math.max(0, Math.ceil(Math.log2(perSecond / MOST_SAMPLES_S)));
  }

  private drawTime(): void {
    const { timeS, firstS, lastS, playing, speed, following } = this.clock;
    const scrub = byId<HTMLInputElement>("scrub");
    scrub.value = String((10_000 * (timeS - firstS)) / Math.max(1e-9, lastS - firstS));
    const time = byId<HTMLInputElement>("time");
    if (document.activeElement !== time) time.value = timeS.toFixed(3);
    byId("end").textContent = `of ${lastS.toFixed(1)} s`;
    byId("speed").textContent = `${speed}×`;
    byId("play").textContent = playing ? "❚❚" : "▶";
    byId("play").title = playing ? "pause (space)" : "play (space)";
    byId("live").hidden = !following || !this.scenes.some((scene) => scene.status === RUNNING);
    this.curves.setTime(timeS);
    this.count();
    this.inspector.update(timeS, this.panes[0].shownMoment?.modules);
  }
}

function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

function hideUnless(action: string, useful: boolean): void {
  document.querySelector(`button[data-action="${action}"]`)?.toggleAttribute("hidden", !useful);
}

async function main(): Promise<void> {
  try {
    const source = (await Exported.read()) ?? new Server();
    const scenes = await source.scenes();
    document.title = `${scenes.map((scene) => scene.name).join(" | ")} - Kilotwin`;
    const panes = scenes.map((scene, run) => new Pane(scene, source, run));
    const page = new Page(source, scenes, panes);
    await page.start();
    document.body.dataset.ready = "yes";
  } catch (error) {
    const gone = byId("gone");
    gone.textContent = `The run cannot be shown: ${(error as Error).message}`;
    gone.hidden = false;
    document.body.dataset.ready = "failed";
  }
}

void main();
