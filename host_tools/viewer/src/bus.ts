// Facts that a listener on a grid's buses has beside robots: rates, load, silent modules.

export interface BusState {
  buses: { name: string; frames_s: number; load: number; trouble: string | null }[];
  reports_s: number;
  silent: [number, number][];
  strangers: number;
}

const EVERY_MS = 1000;

// Shows it in `element`, for as long as the server answers.
export async function showBuses(element: HTMLElement): Promise<void> {
  element.hidden = false;
  while (true) {
    const answer = await fetch("bus").catch(() => null);
    if (!answer?.ok) return;
    element.replaceChildren(...rowsOf(await answer.json()));
    await new Promise((resolve) => setTimeout(resolve, EVERY_MS));
  }
}

function rowsOf(state: BusState): HTMLElement[] {
  const line = (text: string, className = "") =>
    Object.assign(document.createElement("p"), { textContent: text, className });
  const heading = Object.assign(document.createElement("h2"), { textContent: "buses" });
  const buses = state.buses.map((bus) => {
    const load = `${(100 * bus.load).toFixed(1)} %`;
    return line(bus.trouble ?? `${bus.name}: ${bus.frames_s} frames/s, load ${load}`);
  });
  const silent = state.silent.map(([x, y]) => `${x},${y}`).join(" ");
  const rows = [heading, ...buses, line(`${state.reports_s} reports/s`)];
  rows.push(line(silent ? `silent modules: ${silent}` : "no module is silent", "silent"));
  if (state.strangers) rows.push(line(`${state.strangers} reports of robots not in the file`));
  return rows;
}
