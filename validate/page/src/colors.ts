// Colours of values.

export type Rgb = [number, number, number];

/** Viridis (van der Walt and Smith), by a polynomial of degree 6 fitted to it: within 5 levels. */
const kViridis = [
  [0.2777273272234177, 0.005407344544966578, 0.3340998053353061],
  [0.1050930431085774, 1.404613529898575, 1.384590162594685],
  [-0.3308618287255563, 0.214847559468213, 0.09509516302823659],
  [-4.634230498983486, -5.799100973351585, -19.33244095627987],
  [6.228269936347081, 14.17993336680509, 56.69055260068105],
  [4.776384997670288, -13.74514537774601, -65.35303263337234],
  [-5.435455855934631, 4.645852612178535, 26.3124352495832],
];
export function viridis(t: number): Rgb {
  const at = Math.min(1, Math.max(0, t));
  return [0, 1, 2].map(c => {
    let value = 0;
    for (let k = kViridis.length - 1; k >= 0; k--) value = value * at + kViridis[k][c];
    return Math.round(255 * Math.min(1, Math.max(0, value)));
  }) as Rgb;
}

/** Blue below, white at 0, red above: told apart by everybody's eyes. */
const kDiverging: Rgb[] =
    [[5, 48, 97], [67, 147, 195], [247, 247, 247], [214, 96, 77], [103, 0, 31]];
export function diverging(t: number): Rgb {
  const at = Math.min(1, Math.max(0, 0.5 + 0.5 * t)) * (kDiverging.length - 1);
  const k = Math.min(Math.floor(at), kDiverging.length - 2);
  return [
    0, 1, 2
  ].map(c => Math.round(kDiverging[k][c] + (at - k) * (kDiverging[k + 1][c] - kDiverging[k][c]))) as
      Rgb;
}

/**
 * The colour wheel of Baker et al., A Database and Evaluation Methodology for Optical Flow (2011):
 * 55 hues whose steps look alike; white without motion, paler the shorter the flow.
 */
const kWheel: Rgb[] = (() => {
  const wheel: Rgb[] = [];
  const ramp = (steps: number, color: (t: number) => Rgb) => {
    for (let k = 0; k < steps; k++) wheel.push(color(Math.floor(255 * k / steps)));
  };
  ramp(15, t => [255, t, 0]);        // red to yellow
  ramp(6, t => [255 - t, 255, 0]);   // to green
  ramp(4, t => [0, 255, t]);         // to cyan
  ramp(11, t => [0, 255 - t, 255]);  // to blue
  ramp(13, t => [t, 0, 255]);        // to magenta
  ramp(6, t => [255, 0, 255 - t]);   // to red
  return wheel;
})();
/** u right, v down, in units of the longest flow; beyond 1 darker. */
export function flowColor(u: number, v: number): Rgb {
  const length = Math.hypot(u, v);
  const at = (Math.atan2(-v, -u) / Math.PI + 1) / 2 * (kWheel.length - 1);
  const k = Math.floor(at);
  const next = kWheel[(k + 1) % kWheel.length];
  return [0, 1, 2].map(c => {
    const hue = (kWheel[k][c] + (at - k) * (next[c] - kWheel[k][c])) / 255;
    return Math.floor(255 * (length <= 1 ? 1 - length * (1 - hue) : 0.75 * hue));
  }) as Rgb;
}

/** Kinds that have no order: Okabe and Ito's colours, then lighter and darker ones of the same. */
const kKinds: Rgb[] = [
  [0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0],
  [240, 228, 66], [140, 140, 140]
];
export function kindColor(index: number): Rgb {
  const base = kKinds[index % kKinds.length];
  const round = Math.floor(index / kKinds.length) % 3;
  const mixed = [0, 255, 0][round], part = [0, 0.45, 0.4][round];
  return base.map(c => Math.round(c + part * (mixed - c))) as Rgb;
}

export const css = (color: Rgb) => `rgb(${color.join(' ')})`;
