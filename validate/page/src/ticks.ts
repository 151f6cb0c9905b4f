// Round numbers for axes.

/** Round values from `least` to `most`, about `count` of them; few for any numbers. */
export function ticks(least: number, most: number, count: number): number[] {
  const raw = (most - least) / count;
  if (!(raw > 0) || !Number.isFinite(raw)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5].find(factor => raw <= factor * power) ?? 10);
  const values: number[] = [];
  const first = Math.ceil(least / step);
  // Counted, not summed: a sum of steps need not advance where the values dwarf the step.
  for (let i = 0; i <= 2 * count && (first + i) * step <= most; i++)
    values.push((first + i) * step + 0);
  return values;
}

/** 1, 2 and 5 times powers of ten; powers alone where those are many. */
export function logTicks(least: number, most: number): number[] {
  const values: number[] = [];
  const decades = Math.log10(most / least);
  for (let power = Math.floor(Math.log10(least)); power <= Math.ceil(Math.log10(most)); power++)
    for (const factor of decades > 4 ? [1] : decades > 1.5 ? [1, 3] : [1, 2, 5])
      if (factor * 10 ** power >= least && factor * 10 ** power <= most)
        values.push(factor * 10 ** power);
  return values;
}
