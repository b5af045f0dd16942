// One run in the picture: a canvas for graphics and one above it for text and rings.

import * as three from "three";
import { Dots } from "./dots";
import { Failures } from "./failures";
import { Floor, segments } from "./floor";
import { links, trails } from "./lines";
import type { Moment } from "./live";
import { leastRadius, Robots, type Colouring } from "./robots";
import { beatOf, Rings, sentIn } from "./messages";
import { Passages } from "./passages";
import { placeOf, Samples, spreadSample, type Between, type Sample } from "./samples";
import { boxOf, uidOf, type Report, type Scene } from "./scene";
import type { Source } from "./source";
import { Tape } from "./tape";
import { Values } from "./values";

export interface Layers {
  trails: boolean;
  links: boolean;
  messages: boolean;
  cells: boolean;
  floor: boolean;
  light: boolean;
  reports: boolean;
  uids: boolean;
  states: boolean; // colours of states in place of LEDs
}

export type Picked = { robot: number } | { module: [number, number]; cell: number } | null;

const TRAIL_SAMPLES = 40;
const ALL_TRAILS = 3000; // robots; of larger swarms the chosen one only
const ALL_LINKS = 5000;
const MOST_LINKS = 60_000;
const MOST_LABELS = 400;
const WALK_M_S = 0.0103; // how fast the doubt about a robot grows that was not heard of

export class Pane {
  readonly samples: Samples;
  readonly element = document.createElement("div");
  private readonly overlay = document.createElement("canvas");
  private readonly renderer: three.WebGLRenderer;
  private readonly world = new three.Scene();
  private readonly camera = new three.OrthographicCamera();
  private readonly robots: Robots;
  private readonly dots: Dots;
  private readonly rings: Rings;
  private readonly floor: Floor;
  private readonly ids: Uint32Array;
  private readonly trail = segments(new Float32Array(0), "#202020", 0.45, 9);
  private readonly link = segments(new Float32Array(0), "#0072b2", 0.35, 9);
  private middle: [number, number] = [0, 0];
  private pixelM = 0.01;
  private fitted = true;
  private selected: number | null = null; // place in a sample
  private spread: { of: Sample; as: Sample } | null = null;
  private linesOf = "";
  private looks = "";
  private stale = true; // what stands still must be drawn again
  private labelled = false;
  private heard: Report[] = [];
  private heardAt = -1;
  private moment: Between | null = null;
  // That is drawn in place of samples.
  shownMoment: Moment | null = null;
  // Whether a robot that is dragged is put elsewhere, or turned with Shift, in place of the view's
  // being moved.
  grabs = false;
  // Whether the chosen robot stays in the middle.
  follows = false;
  dropped: (robot: number, x: number, y: number) => void = () => {};
  turned: (robot: number, headingRad: number) => void = () => {};
  private held: { place: number; at: [number, number]; turns: boolean } | null = null;
  shown: Between | null = null;
  readonly failures: Failures;
  readonly tape = new Tape();
  private readonly passages: Passages;
  readonly values = new Values();
  // Called with what was clicked.
  picked: (what: Picked) => void = () => {};
  // Called when the picture must be drawn again.
  dirty: () => void = () => {};

  constructor(
    readonly scene: Scene,
    private readonly source: Source,
    private readonly run: number,
  ) {
    this.ids = Uint32Array.from(scene.recorded ?? Array.from({ length: scene.robots }, (_, k) => k));
    this.samples = new Samples(source, run, this.ids.length, scene.objects.length);
    this.samples.arrived = () => this.dirty();
    this.renderer = new three.WebGLRenderer({ antialias: false, alpha: true });
    this.renderer.setClearColor(0, 0);
    window.addEventListener("redraw", () => (this.stale = true));
    this.failures = new Failures(scene);
    this.passages = new Passages(scene, source, run);
    this.floor = new Floor(scene, (timeS) => source.cells(run, timeS));
    this.robots = new Robots(scene, this.ids.length, this.ids);
    this.dots = new Dots(scene, this.ids.length, this.ids);
    this.rings = new Rings(this.robots.places, this.ids.length, scene.radius_m, scene.range_m);
    this.world.add(this.floor.group, this.trail, this.link, this.robots.mesh, this.rings.mesh);
    this.element.className = "pane";
    this.overlay.className = "overlay";
    this.element.append(this.renderer.domElement, this.dots.canvas, this.overlay);
    new ResizeObserver(() => this.resize()).observe(this.element);
    this.listen();
  }

  // The robot in a place of the samples.
  idOf(place: number): number {
    return this.ids[place];
  }

  placeOf(robot: number): number {
    return this.ids.indexOf(robot);
  }

  select(robot: number | null): void {
    const place = robot === null ? -1 : this.placeOf(robot);
    this.selected = place < 0 ? null : place;
    this.linesOf = "stale";
    this.dirty();
  }

  // Draws also what stands still.
  redraw(): void {
    this.stale = true;
    this.dirty();
  }

  colourBy(what: Colouring): void {
    this.stale = true;
    this.robots.colourBy(what);
    this.dots.colourBy(what);
    this.dirty();
  }

  // Draws these robots in place of the time's, until it is called with null.
  showMoment(moment: Moment | null): void {
    this.shownMoment = moment;
    const sample = moment?.sample ?? null;
    if (this.moment?.from === sample || (!this.moment && !sample)) return;
    const first = Math.max(0, this.samples.count - 1);
    this.moment = moment && {
      from: moment.sample,
      to: moment.sample,
      part: 0,
      first,
      spanS: moment.spanS,
      earlier: moment.earlier ?? moment.sample,
    };
    this.linesOf = "";
  }

  // Draws a time; false if its samples have not come yet.
  draw(timeS: number, stride: number, layers: Layers, speed: number): boolean {
    const between = this.moment ?? this.samples.between(timeS, stride);
    if (between) {
      this.shown = this.spreadOut(between);
      if (this.follows && this.selected !== null) this.keepInMiddle(this.shown, this.selected);
      this.drawRobots(this.shown, layers, speed);
      if (this.floor.show(between.from, between.to, between.part, timeS)) this.stale = true;
      this.floor.showLayers(layers);
      this.drawLines(this.shown, stride, layers);
    }
    if (layers.reports) this.askForReports(timeS);
    // Things that stand still are drawn once where robots are dots.
    const theme = document.documentElement.dataset.theme;
    const looks = `${JSON.stringify(layers)}:${this.linesOf}:${theme}`;
    if (this.stale || this.robots.mesh.visible || looks !== this.looks) {
      this.renderer.render(this.world, this.camera);
    }
    this.drawOverlay(timeS, layers, this.stale || looks !== this.looks);
    [this.stale, this.looks] = [false, looks];
    return between !== null;
  }

  // Many small ones as dots, others as points of the graphics processor.
  private drawRobots(shown: Between, layers: Layers, speed: number): void {
    const between = this.values.coloured(shown);
    const [width, height] = this.size();
    const least = leastRadius(this.ids.length, width * height);
    const ratio = window.devicePixelRatio;
    const radius = Math.max(this.scene.radius_m / this.pixelM, least);
    const small = this.dots.serves(radius);
    this.robots.mesh.visible = !small;
    const sent = layers.messages ? sentIn(between) : null;
    const beat = beatOf(between, speed);
    this.rings.show(small ? null : sent, between.part, beat);
    if (small) {
      const [x, y] = this.pixel(0, 0);
      const perMetre = ratio / this.pixelM;
      const view = { x: x * ratio, y: y * ratio, perMetre, radius: radius * ratio };
      this.dots.paint(between, view, sent, beat);
      return;
    }
    this.dots.clear();
    this.robots.show(between);
    const across = (pixels: number) => 2 / ((pixels + 2 * this.margin()) * this.pixelM);
    const scale: [number, number] = [across(width), across(height)];
    this.robots.view(this.middle, scale, this.pixelM, least);
    this.rings.view(this.middle, scale, this.pixelM);
  }

  private keepInMiddle(between: Between, place: number): void {
    const [x, y] = placeOf(between, place);
    if (Number.isNaN(x) || Number.isNaN(y)) return;
    if (x === this.middle[0] && y === this.middle[1]) return;
    this.middle = [x, y];
    this.fitted = false;
    this.moved(false);
  }

  // The picture as it is shown, for a file; drawn into a canvas of that size.
  picture(canvas = document.createElement("canvas")): HTMLCanvasElement {
    this.renderer.render(this.world, this.camera); // its pixels are kept until the next frame only
    const { width, height } = this.overlay;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d")!;
    context.fillStyle = getComputedStyle(document.body).backgroundColor;
    context.fillRect(0, 0, canvas.width, canvas.height);
    for (const layer of [this.renderer.domElement, this.dots.canvas, this.overlay]) {
      context.drawImage(layer, 0, 0, canvas.width, canvas.height);
    }
    return canvas;
  }

  fit(byHand = true): void {
    const [left, low, right, top] = boxOf(this.scene.arena);
    const [width, height] = this.size();
    this.middle = [(left + right) / 2, (low + top) / 2];
    this.pixelM = 1.06 * Math.max((right - left) / width, (top - low) / height);
    this.fitted = true;
    this.moved(byHand);
  }

  zoom(factor: number, x?: number, y?: number): void {
    const [width, height] = this.size();
    const [px, py] = [x ?? width / 2, y ?? height / 2];
    const before = this.place(px, py);
    this.pixelM = Math.min(1, Math.max(1e-5, this.pixelM / factor));
    const after = this.place(px, py);
    this.pan(before[0] - after[0], before[1] - after[1]);
  }

  // Moves the middle by metres.
  pan(dx: number, dy: number): void {
    this.middle = [this.middle[0] + dx, this.middle[1] + dy];
    this.fitted = false;
    this.moved();
  }

  // Shows the same part of the table as another pane.
  follow(other: Pane): void {
    this.middle = [...other.middle];
    this.pixelM = other.pixelM;
    this.fitted = other.fitted;
    this.moved(false);
  }

  // Called with this pane when its view has been moved by hand.
  viewMoved: (pane: Pane) => void = () => {};

  private moved(byHand = true): void {
    this.stale = true;
    const [width, height] = this.size();
    const around = this.margin();
    this.renderer.setViewport(-around, -around, width + 2 * around, height + 2 * around);
    const [x, y] = [
      (width / 2 + around) * this.pixelM,
      (height / 2 + around) * this.pixelM,
    ];
    Object.assign(this.camera, {
      left: this.middle[0] - x,
      right: this.middle[0] + x,
      bottom: this.middle[1] - y,
      top: this.middle[1] + y,
      near: -1,
      far: 1,
    });
    this.camera.updateProjectionMatrix();
    if (byHand) this.viewMoved(this);
    this.dirty();
  }

  private size(): [number, number] {
    return [Math.max(1, this.element.clientWidth), Math.max(1, this.element.clientHeight)];
  }

  // Pixels around the canvas that are drawn into, though not seen: a robot whose middle lies there
  // is a point of which a part is seen.
  private margin(): number {
    return Math.ceil(Math.min(1000, (1.35 * this.scene.radius_m) / this.pixelM + 4));
  }

  private resize(): void {
    const [width, height] = this.size();
    const ratio = window.devicePixelRatio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    this.overlay.width = width * ratio;
    this.overlay.height = height * ratio;
    this.dots.resize(width * ratio, height * ratio);
    if (this.fitted) this.fit(false);
    else this.moved(false);
  }

  // Where a pixel is on the table, m.
  private place(px: number, py: number): [number, number] {
    const [width, height] = this.size();
    return [
      this.middle[0] + (px - width / 2) * this.pixelM,
      this.middle[1] - (py - height / 2) * this.pixelM,
    ];
  }

  private pixel(x: number, y: number): [number, number] {
    const [width, height] = this.size();
    return [
      width / 2 + (x - this.middle[0]) / this.pixelM,
      height / 2 - (y - this.middle[1]) / this.pixelM,
    ];
  }

  // A host knows a robot's cell only: those of one cell stand around its middle, not on it.
  private spreadOut(between: Between): Between {
    if (this.scene.emulated) return between;
    if (this.spread?.of !== between.from) {
      this.spread = { of: between.from, as: spreadSample(between.from, this.scene.radius_m) };
    }
    return { ...between, from: this.spread.as, to: this.spread.as, part: 0 };
  }

  private drawLines(between: Between, stride: number, layers: Layers): void {
    const number = between.from.x.length;
    const wanted = layers.trails || layers.links || this.selected !== null;
    const of = `${between.first}:${stride}:${this.selected}:${layers.trails}:${layers.links}`;
    const key = wanted ? of : "none";
    if (key === this.linesOf) return;
    this.linesOf = key;
    let trail: Float32Array = new Float32Array(0);
    if (layers.trails || this.selected !== null) {
      const chosen = layers.trails && number <= ALL_TRAILS ? null : this.chosen();
      trail = trails(this.before(between, stride), chosen);
    }
    const shown = layers.links && number <= ALL_LINKS;
    replace(this.trail, trail);
    replace(
      this.link,
      shown ? links(between.from, this.scene.range_m, MOST_LINKS) : new Float32Array(0),
    );
  }

  private chosen(): number[] {
    return this.selected === null ? [] : [this.selected];
  }

  // The samples up to those that are shown, as far as they are here.
  private before(between: Between, stride: number): Sample[] {
    const found = [between.to];
    for (let k = 0; k < TRAIL_SAMPLES && between.first >= k * stride; k++) {
      const sample = this.samples.sample(between.first - k * stride, stride);
      if (!sample) {
        this.linesOf = "stale";
        break;
      }
      found.unshift(sample);
    }
    return found;
  }

  private async askForReports(timeS: number): Promise<void> {
    if (!this.scene.grid || this.heardAt === timeS) return;
    this.heardAt = timeS;
    this.heard = await this.source.reports(this.run, timeS).catch(() => this.heard);
    if (this.heardAt === timeS) this.dirty();
  }

  private drawOverlay(timeS: number, layers: Layers, changed: boolean): void {
    const labelled =
      layers.reports ||
      this.showsUids(layers) ||
      this.selected !== null ||
      this.tape.on ||
      this.passages.any(layers.messages) ||
      this.failures.by(timeS) > 0;
    if (!changed && !labelled && !this.labelled) return;
    this.labelled = labelled;
    const context = this.overlay.getContext("2d")!;
    const ratio = window.devicePixelRatio;
    const [width, height] = this.size();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    if (layers.reports) this.drawReports(context, timeS);
    if (this.shown) this.drawUids(context, this.shown, layers);
    const { shown } = this;
    const pixelOf = (place: number) => this.pixel(...placeOf(shown!, place));
    if (shown) this.failures.draw(context, timeS, this.scene.radius_m / this.pixelM, pixelOf);
    if (shown) this.passages.draw(context, timeS, layers.messages, pixelOf, () => this.redraw());
    if (shown) this.tape.draw(context, (robot) => placeOf(shown, robot), (x, y) => this.pixel(x, y));
    if (this.held?.turns) this.drawTurned(context, this.held.place, this.held.at);
    else if (this.held) this.drawHeld(context, this.held.at);
    this.drawScale(context, height);
  }

  private showsUids(layers: Layers): boolean {
    return this.scene.radius_m / this.pixelM > 9 || layers.uids;
  }

  // A mark where the host heard a robot last, and a circle as far as it may have gone since.
  private drawReports(context: CanvasRenderingContext2D, timeS: number): void {
    context.strokeStyle = "#cc3399";
    for (const report of this.heard) {
      const [px, py] = this.pixel(report[2], report[3]);
      const ageS = Math.max(0, timeS - report[0]);
      const doubt = (this.scene.grid!.cell_m / 2 + ageS * WALK_M_S) / this.pixelM;
      context.globalAlpha = Math.max(0.15, 1 - ageS / 60);
      context.beginPath();
      context.arc(px, py, Math.min(doubt, 4000), 0, 2 * Math.PI);
      context.stroke();
      context.fillStyle = "#cc3399";
      context.fillRect(px - 2, py - 2, 4, 4);
    }
    context.globalAlpha = 1;
  }

  private drawUids(context: CanvasRenderingContext2D, between: Between, layers: Layers): void {
    const number = between.from.x.length;
    const near = this.showsUids(layers);
    const [width, height] = this.size();
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    let left = MOST_LABELS;
    const at = (k: number) => this.pixel(...placeOf(between, k));
    const label = (k: number) => {
      const [px, py] = at(k);
      if (!(px > 0 && px < width && py > 0 && py < height) || left-- <= 0) return;
      const below = py + Math.max(this.scene.radius_m / this.pixelM, 3) + 11;
      context.lineWidth = 3;
      context.strokeStyle = "#ffffffd0";
      const named = this.values.name === null || layers.uids;
      const uid = named ? String(uidOf(this.scene, this.ids[k])) : "";
      const text = [uid, this.values.label(between.from, k)].filter(Boolean).join(": ");
      context.strokeText(text, px, below);
      context.fillStyle = "#000";
      context.fillText(text, px, below);
    };
    if (near) for (let k = 0; k < number && left > 0; k++) label(k);
    if (this.selected === null) return;
    if (!near) label(this.selected);
    context.lineWidth = 2.5;
    context.strokeStyle = "#ff4000";
    context.beginPath();
    context.arc(...at(this.selected), Math.max(1.3 * (this.scene.radius_m / this.pixelM), 9), 0, 7);
    context.stroke();
  }

  // Where a robot would be put.
  private drawHeld(context: CanvasRenderingContext2D, at: [number, number]): void {
    context.strokeStyle = "#ff4000";
    context.lineWidth = 2;
    context.setLineDash([4, 3]);
    context.beginPath();
    context.arc(...this.pixel(...at), Math.max(4, this.scene.radius_m / this.pixelM), 0, 7);
    context.stroke();
    context.setLineDash([]);
  }

  // Where a robot would look to.
  private drawTurned(
    context: CanvasRenderingContext2D,
    place: number,
    at: [number, number],
  ): void {
    context.strokeStyle = "#ff4000";
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(...this.pixel(...placeOf(this.shown!, place)));
    context.lineTo(...this.pixel(...at));
    context.stroke();
  }

  private drawScale(context: CanvasRenderingContext2D, height: number): void {
    const rough = 120 * this.pixelM;
    const power = 10 ** Math.floor(Math.log10(rough));
    const length = ([5, 2, 1].find((step) => step * power <= rough) ?? 1) * power;
    const text = length >= 1 ? `${length} m` : `${Math.round(length * 100 * 1000) / 1000} cm`;
    const ink = getComputedStyle(this.element).color;
    context.fillStyle = ink;
    context.fillRect(12, height - 14, length / this.pixelM, 3);
    context.textAlign = "left";
    context.font = "12px system-ui, sans-serif";
    context.fillText(text, 12, height - 20);
  }

  private listen(): void {
    const pointers = new Map<number, PointerEvent>();
    let travelled = 0;
    const own = (event: PointerEvent | WheelEvent): [number, number] => {
      const box = this.element.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    this.element.addEventListener("pointerdown", (event) => {
      this.element.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, event);
      if (pointers.size === 1) travelled = 0;
      const under = this.grabs && pointers.size === 1 ? this.robotAt(...own(event)) : null;
      const turns = event.shiftKey;
      this.held = under === null ? null : { place: under, at: this.place(...own(event)), turns };
    });
    this.element.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return;
      const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
      travelled += Math.abs(dx) + Math.abs(dy);
      if (this.held) {
        this.held.at = this.place(...own(event));
        this.dirty();
      } else if (pointers.size === 2) {
        const other = [...pointers.values()].find((one) => one.pointerId !== event.pointerId)!;
        const apart = (one: PointerEvent) =>
          Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
        this.zoom(Math.max(0.5, Math.min(2, apart(event) / Math.max(1, apart(last)))), ...own(event));
      } else if (travelled > 4) {
        this.pan(-dx * this.pixelM, dy * this.pixelM);
      }
      pointers.set(event.pointerId, event);
    });
    const released = (event: PointerEvent) => {
      const { held } = this;
      this.held = null;
      if (held && travelled > 4 && event.type === "pointerup") {
        this.release(held.place, held.at, held.turns);
        this.dirty();
      }
      if (pointers.delete(event.pointerId) && event.type === "pointerup" && travelled <= 4) {
        this.pick(...own(event));
      }
    };
    this.element.addEventListener("pointerup", released);
    this.element.addEventListener("pointercancel", released);
    this.element.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.zoom(Math.exp(-event.deltaY / 400), ...own(event));
      },
      { passive: false },
    );
    this.element.addEventListener("dblclick", () => this.fit());
  }

  private release(place: number, [x, y]: [number, number], turns: boolean): void {
    if (!turns) return this.dropped(this.ids[place], x, y);
    const [fromX, fromY] = placeOf(this.shown!, place);
    this.turned(this.ids[place], Math.atan2(y - fromY, x - fromX));
  }

  // The place in a sample of the robot under a pixel.
  private robotAt(px: number, py: number): number | null {
    const [x, y] = this.place(px, py);
    let best: number | null = null;
    let nearest = Math.max(this.scene.radius_m, 6 * this.pixelM);
    for (let k = 0; k < (this.shown?.from.x.length ?? 0); k++) {
      const [robotX, robotY] = placeOf(this.shown!, k);
      const away = Math.hypot(robotX - x, robotY - y);
      if (away <= nearest) [best, nearest] = [k, away];
    }
    return best;
  }

  // The robot under a pixel, else the cell.
  private pick(px: number, py: number): void {
    const robot = this.robotAt(px, py);
    if (this.tape.on) {
      this.tape.put(robot ?? this.place(px, py));
      return this.dirty();
    }
    if (robot !== null) this.picked({ robot: this.ids[robot] });
    else this.picked(this.cellAt(...this.place(px, py)));
  }

  private cellAt(x: number, y: number): Picked {
    const grid = this.scene.grid;
    if (!grid) return null;
    const column = Math.floor(x / grid.cell_m + grid.columns);
    const row = Math.floor(y / grid.cell_m + grid.rows);
    if (column < 0 || row < 0 || column >= 2 * grid.columns || row >= 2 * grid.rows) return null;
    // 0 top left, 1 top right, 2 bottom left, 3 bottom right
    return { module: [column >> 1, row >> 1], cell: (row % 2 ? 0 : 2) + (column % 2) };
  }
}

function replace(lines: three.LineSegments, points: Float32Array): void {
  lines.geometry.dispose();
  lines.geometry = new three.BufferGeometry();
  lines.geometry.setAttribute("position", new three.BufferAttribute(points, 3));
  lines.visible = points.length > 0;
}
