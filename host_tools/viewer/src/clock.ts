// The time that is shown, the same for all runs of a page.

export const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
const WHOLE_RUN_S = 60;

export class Clock {
  timeS = 0;
  playing = false;
  // Simulated seconds in a second.
  speed = 1;
  firstS = 0;
  lastS = 0;
  // Whether the time stays at the end of a run that goes on.
  following = false;
  changed: () => void = () => {};

  // A speed at which all of it is seen in about a minute.
  setRange(firstS: number, lastS: number, durationS: number): void {
    this.firstS = firstS;
    this.lastS = lastS;
    this.timeS = Math.max(firstS, this.timeS);
    this.speed = SPEEDS.find((speed) => durationS / speed <= WHOLE_RUN_S) ?? SPEEDS.at(-1)!;
  }

  extend(lastS: number): void {
    this.lastS = Math.max(this.lastS, lastS);
    if (this.following) this.go(this.lastS);
  }

  go(timeS: number): void {
    this.timeS = Math.min(this.lastS, Math.max(this.firstS, timeS));
    this.changed();
  }

  // Lets some wall time pass; false if nothing moved.
  advance(seconds: number): boolean {
    if (!this.playing) return false;
    this.timeS = Math.min(this.lastS, this.timeS + seconds * this.speed);
    if (this.timeS >= this.lastS && !this.following) this.playing = false;
    this.changed();
    return true;
  }

  toggle(): void {
    if (!this.playing && this.timeS >= this.lastS) this.timeS = this.firstS;
    this.playing = !this.playing;
    this.following = false;
    this.changed();
  }

  faster(steps: number): void {
    const now = SPEEDS.findIndex((speed) => speed >= this.speed);
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, now + steps))];
    this.changed();
  }
}
