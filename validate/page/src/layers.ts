// The layers of an image as pictures, each with its legend.
import {css, diverging, flowColor, kindColor, viridis, type Rgb} from './colors';
import {h, shown, svg} from './dom';
import {isUsable, normalAt} from './geometry';
import type {Layers} from './load';
import {logTicks} from './ticks';
import type {Camera, Image, Sequence} from './types';

export interface Layer {
  /** Colours of the grid's places, and what the colours mean. */
  paint(image: Image, camera: Camera, sequence: Sequence, layers: Layers):
      {picture: ImageData|null; legend: Node[]};
  title: string;
  needs: string;  ///< of Image.layers; '': colours
}

function painted(image: Image, color: (i: number, x: number, y: number) => Rgb | null): ImageData {
  const picture = new ImageData(image.width, image.height);
  for (let y = 0, i = 0; y < image.height; y++)
    for (let x = 0; x < image.width; x++, i++) {
      const rgb = color(i, x, y);
      if (rgb) picture.data.set([rgb[0], rgb[1], rgb[2], 255], 4 * i);
    }
  return picture;
}

/** What `share` of the finite values lie below. */
function quantiles(values: ArrayLike<number>, shares: number[]): number[] {
  const finite = Float64Array.from(Array.prototype.filter.call(values, Number.isFinite)).sort();
  return shares.map(share => finite.length ? finite[Math.round(share * (finite.length - 1))] : NaN);
}

/** A strip of colours with numbers below it. */
function colorbar(
    color: (t: number) => Rgb, label: string, marks: {at: number; text: string}[]): Node {
  const stops = [...Array(33).keys()].map(k => css(color(k / 32))).join(',');
  return h(
      'div', {class: 'colorbar'},
      h('div', {class: 'strip', style: `background:linear-gradient(90deg,${stops})`}),
      h('div', {class: 'marks'},
        ...marks.map(
            mark => h(
                'span', {style: `left:${100 * mark.at}%;transform:translateX(${- 100 * mark.at}%)`},
                mark.text))),
      h('div', {class: 'soft'}, label));
}

const nothing = (text: string) => h('p', {class: 'soft'}, text);
const swatch = (color: string, text: string) =>
    h('span', {class: 'key'}, h('span', {class: 'swatch', style: `background:${color}`}), text);
const without = (text: string) =>
    swatch('repeating-linear-gradient(45deg,#8886 0 3px,transparent 3px 6px)', text);

const depth: Layer = {
  title: 'Depth',
  needs: 'depth',
  paint(image, _camera, _sequence, layers) {
    const values = layers.depth;
    const [least, most] = quantiles(values, [0.01, 0.99]);
    if (!(most > 0)) return {picture: null, legend: [nothing('No pixel has depth: all is sky.')]};
    const span = Math.max(Math.log(most / least), 1e-3);
    const at = (value: number) => 1 - Math.log(value / least) / span;  // near is bright
    return {
      picture: painted(image, i => Number.isFinite(values[i]) ? viridis(at(values[i])) : null),
      legend: [
        colorbar(
            t => viridis(1 - t),
            'depth along the optical axis, m, on a logarithmic scale; the outermost percent beyond the ends',
            logTicks(least, least * Math.exp(span))
                .map(value => ({at: 1 - at(value), text: shown(value, 3)}))),
        without('none: sky')
      ],
    };
  },
};

const normals: Layer = {
  title: 'Normals',
  needs: 'depth',
  paint(image, camera, _sequence, layers) {
    if (!isUsable(camera) || !image.pose)
      return {picture: null, legend: [nothing('Without pose or intrinsics there are no normals.')]};
    const shade = (n: number) => Math.round(127.5 + 127.5 * n);
    return {
      picture: painted(
          image,
          (_i, x, y) => {
            const n = normalAt(camera, image, layers.depth, x, y);
            return n ? [shade(n[0]), shade(n[1]), shade(n[2])] : null;
          }),
      legend: [
        nothing(
            'The format holds no normals: these are by the gradient of the depth between neighbouring places of this view. East is red, north green, up blue.'),
        swatch(css([shade(0), shade(0), 255]), 'level'),
        swatch(css([shade(0.7), shade(0), shade(0.7)]), 'falls to the east'),
        swatch(css([shade(0), shade(0.7), shade(0.7)]), 'falls to the north'),
        swatch(css([shade(-0.7), shade(0), shade(0.7)]), 'falls to the west'),
        swatch(css([shade(0), shade(-0.7), shade(0.7)]), 'falls to the south'), without('none')
      ],
    };
  },
};

function wheel(longest_px: number): Node {
  const size = 88, canvas = h('canvas', {
                     width: size,
                     height: size,
                     class: 'wheel',
                     role: 'img',
                     'aria-label': 'colour wheel of flow'
                   });
  const picture = new ImageData(size, size);
  for (let y = 0; y < size; y++)
    for (let x = 0; x < size; x++) {
      const u = (x + 0.5) / (size / 2) - 1, v = (y + 0.5) / (size / 2) - 1;
      if (Math.hypot(u, v) <= 1) picture.data.set([...flowColor(u, v), 255], 4 * (y * size + x));
    }
  canvas.getContext('2d')!.putImageData(picture, 0, 0);
  return h(
      'div', {class: 'wheel'}, canvas,
      h('span', {class: 'soft'},
        `The direction of the flow to the next frame, as the wheel of Baker et al. (2011) has it; the rim is ${
            shown(longest_px, 3)} px (the longest but for one percent, which is darker).`));
}

const flow: Layer = {
  title: 'Flow',
  needs: 'flow',
  paint(image, _camera, _sequence, layers) {
    const values = layers.flow, count = values.length / 2;
    const lengths =
        Float32Array.from({length: count}, (_, i) => Math.hypot(values[i], values[count + i]));
    const longest = Math.max(quantiles(lengths, [0.99])[0], 1e-6);
    if (!Number.isFinite(longest)) return {picture: null, legend: [nothing('No pixel has flow.')]};
    return {
      picture: painted(
          image,
          i => Number.isFinite(values[i]) ?
              flowColor(values[i] / longest, values[count + i] / longest) :
              null),
      legend: [wheel(longest), without('none')],
    };
  },
};

export const className = (sequence: Sequence, id: number) =>
    sequence.classes[String(id)] ?? `class ${id}`;
/** The colour of a class: of its place in the list of all. */
export function classColor(sequence: Sequence, id: number): Rgb {
  const place = Object.keys(sequence.classes).map(Number).sort((a, b) => a - b).indexOf(id);
  return kindColor(place < 0 ? id : place);
}

const classes: Layer = {
  title: 'Classes',
  needs: 'classes',
  paint(image, _camera, sequence, layers) {
    const seen = [...new Set(layers.classes as Uint8Array)].sort((a, b) => a - b);
    const colors = new Map(seen.map(id => [id, classColor(sequence, id)]));
    return {
      picture: painted(image, i => colors.get(layers.classes[i])!),
      legend: seen.map(id => swatch(css(colors.get(id)!), `${className(sequence, id)} (${id})`))
    };
  },
};

/** Bit 0: in the next frame's field of view, bit 1: seen there. */
const kMaskColors: Rgb[] = [[213, 94, 0], [230, 159, 0], [140, 140, 140], [0, 114, 178]];
export const kMaskWords = [
  'outside the next image', 'hidden in the next image, or sky',
  'seen, but not in view: a contradiction', 'seen in the next image'
];
const masks: Layer = {
  title: 'Occlusion',
  needs: 'masks',
  paint: (image, _camera, _sequence, layers) => ({
    picture: painted(image, i => kMaskColors[layers.masks[i] & 3]),
    legend: [3, 1, 0].map(k => swatch(css(kMaskColors[k]), kMaskWords[k])),
  }),
};

const disparity: Layer = {
  title: 'Disparity',
  needs: 'disparity',
  paint(image, _camera, _sequence, layers) {
    const values = layers.disparity;
    const [least, most] = quantiles(values, [0.01, 0.99]);
    if (!Number.isFinite(most))
      return {picture: null, legend: [nothing('No pixel has a disparity.')]};
    const span = Math.max(most - least, 1e-6);
    return {
      picture: painted(
          image, i => Number.isFinite(values[i]) ? viridis((values[i] - least) / span) : null),
      legend: [
        colorbar(
            viridis,
            'disparity, px: what stands so much further right in this image than in the right one',
            [0, 0.25, 0.5, 0.75, 1].map(at => ({at, text: shown(least + at * span, 3)}))),
        without('none')
      ],
    };
  },
};

/** The least 16-bit number stands for a pixel with nothing to compare. */
export const kNoResidual = -32768;
const residual: Layer = {
  title: 'Residual',
  needs: 'residual',
  paint(image, _camera, _sequence, layers) {
    const full = 2000;  // millionths: the bound of the check `reprojection`
    return {
      picture: painted(
          image,
          i => layers.residual[i] === kNoResidual ? null : diverging(layers.residual[i] / full)),
      legend: [
        colorbar(
            t => diverging(2 * t - 1),
            `depth carried into frame ${
                image
                    .residual_frame} of this camera over the depth there, less 1: the check “reprojection” bounds its median by 0.2 %. Nearer there is blue, farther red.`,
            [-0.2, -0.1, 0, 0.1, 0.2].map(
                v => ({at: (v + 0.2) / 0.4, text: `${v > 0 ? '+' : ''}${shown(v)} %`}))),
        without('not seen there, or hidden')
      ],
    };
  },
};

const color: Layer = {
  title: 'Colour',
  needs: '',
  paint: () => ({picture: null, legend: []})
};

export const kLayers: Record<string, Layer> = {
  color,
  depth,
  normals,
  flow,
  classes,
  masks,
  disparity,
  residual
};

/** A cross that is seen on any ground. */
export const cross = (x: number, y: number, size: number) =>
    svg('g', {class: 'cross', transform: `translate(${x} ${y}) scale(${size})`},
        svg('circle', {r: 9}), svg('path', {d: 'M-16 0H-4M4 0H16M0-16V-4M0 4V16'}));
