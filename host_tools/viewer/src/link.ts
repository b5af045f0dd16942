// A moment and a robot in the page's address: #t=312.5&robot=17, the robot by its uid as shown.

export interface Link {
  timeS: number | null;
  robot: number | null;
}

export function linkOf(hash: string): Link {
  const words = new URLSearchParams(hash.replace(/^#/, ""));
  const number = (name: string) => {
    const value = Number(words.get(name) || NaN);
    return Number.isFinite(value) ? value : null;
  };
  return { timeS: number("t"), robot: number("robot") };
}

export function hashOf({ timeS, robot }: Link): string {
  const words = [
    ...(timeS === null ? [] : [`t=${Number(timeS.toFixed(3))}`]),
    ...(robot === null ? [] : [`robot=${robot}`]),
  ];
  return words.length ? `#${words.join("&")}` : "";
}
