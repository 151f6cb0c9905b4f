// Plots and histograms as SVG, with their values under the pointer.
import {h, shown, svg} from './dom';
import {logTicks, ticks} from './ticks';
import type {Octaves, Plot} from './types';

const kWidth = 520, kHeight = 250;
const kLeft = 66, kRight = 16, kTop = 14, kBottom = 46;

interface Axis {
  least: number;
  most: number;
  isLog?: boolean;
  label: string
}
interface Frame {
  root: SVGSVGElement;
  px(x: number): number;
  py(y: number): number;
}

/** A twentieth more at both ends; values that all but agree get room as one value does. */
function widened(values: number[]): [number, number] {
  let least = Infinity, most = -Infinity;
  for (const value of values) {
    least = Math.min(least, value);
    most = Math.max(most, value);
  }
  const extent = most - least, size = Math.max(Math.abs(least), Math.abs(most));
  const margin = extent > 1e-9 * size ? 0.05 * extent : Math.max(1e-12, 0.5 * size);
  const startsAtZero = least >= 0 && least < 0.5 * most;
  return [startsAtZero ? 0 : least - margin, most + margin];
}

/** Axes with grid, ticks and labels. isMap: one scale both ways. */
function frame(x: Axis, y: Axis, title: string, isMap = false): Frame {
  const along = (axis: Axis, value: number) => axis.isLog ?
      Math.log(value / axis.least) / Math.log(axis.most / axis.least) :
      (value - axis.least) / (axis.most - axis.least);
  let width = kWidth - kLeft - kRight, height = kHeight - kTop - kBottom;
  if (isMap) {
    const scale = Math.min(width / (x.most - x.least), height / (y.most - y.least));
    x = {...x, most: x.least + width / scale};
    y = {...y, most: y.least + height / scale};
  }
  const px = (value: number) => kLeft + width * along(x, value);
  const py = (value: number) => kHeight - kBottom - height * along(y, value);
  const root =
      svg('svg',
          {viewBox: `0 0 ${kWidth} ${kHeight}`, class: 'chart', role: 'img', 'aria-label': title});
  for (const value of ticks(y.least, y.most, 4))
    root.append(
        svg('line', {class: 'grid', x1: kLeft, x2: kWidth - kRight, y1: py(value), y2: py(value)}),
        svg('text', {x: kLeft - 8, y: py(value) + 4, 'text-anchor': 'end'}, shown(value, 3)));
  for (const value of x.isLog ? logTicks(x.least, x.most) : ticks(x.least, x.most, 6))
    root.append(
        svg('line', {class: 'grid', y1: kTop, y2: kHeight - kBottom, x1: px(value), x2: px(value)}),
        svg('text', {x: px(value), y: kHeight - kBottom + 17, 'text-anchor': 'middle'},
            shown(value, 4)));
  const middle = kTop + height / 2;
  root.append(
      svg('line', {
        class: 'axis',
        x1: kLeft,
        x2: kWidth - kRight,
        y1: kHeight - kBottom,
        y2: kHeight - kBottom
      }),
      svg('text', {class: 'label', x: kLeft + width / 2, y: kHeight - 8, 'text-anchor': 'middle'},
          x.label),
      svg('text', {
        class: 'label',
        x: 14,
        y: middle,
        'text-anchor': 'middle',
        transform: `rotate(-90 14 ${middle})`
      },
          y.label));
  return {root, px, py};
}

function figure(root: SVGSVGElement, title: string, note: string, legend?: Node): HTMLElement {
  return h(
      'figure', {class: 'chart'},
      h('figcaption', {}, h('b', {}, title), note && h('span', {class: 'soft'}, note)), root,
      legend);
}

/** Shows what `words` says of the nearest place of a list, on a line through it. */
function follow(
    root: SVGSVGElement, places: number[], words: (index: number) => string, tops?: number[]) {
  const line =
      svg('line', {class: 'follow', y1: kTop, y2: kHeight - kBottom, visibility: 'hidden'});
  const dot = svg('circle', {class: 'follow', r: 4, visibility: 'hidden'});
  const text = svg('text', {class: 'follow', y: kTop + 10, visibility: 'hidden'});
  root.append(line, dot, text);
  const hide = () => [line, dot, text].forEach(part => part.setAttribute('visibility', 'hidden'));
  root.addEventListener('pointerleave', hide);
  root.addEventListener('pointermove', event => {
    const box = root.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * kWidth;
    let best = -1;
    for (let i = 0; i < places.length; i++)
      if (Number.isFinite(places[i]) &&
          (best < 0 || Math.abs(places[i] - x) < Math.abs(places[best] - x)))
        best = i;
    if (best < 0) return hide();
    const at = places[best];
    line.setAttribute('x1', String(at));
    line.setAttribute('x2', String(at));
    const isRight = at > kLeft + 0.6 * (kWidth - kLeft - kRight);
    text.setAttribute('x', String(at + (isRight ? -8 : 8)));
    text.setAttribute('text-anchor', isRight ? 'end' : 'start');
    text.textContent = words(best);
    [line, text].forEach(part => part.setAttribute('visibility', 'visible'));
    if (!tops) return;
    dot.setAttribute('cx', String(at));
    dot.setAttribute('cy', String(tops[best]));
    dot.setAttribute('visibility', 'visible');
  });
}

/** A check's plot. bound: where the check fails, drawn if it is in sight. */
export function linePlot(plot: Plot): HTMLElement|null {
  const kFarthest = 1e300;  // beyond it no extent is a number
  const points: [number, number][] = [];
  for (let i = 0; i < Math.min(plot.x.length, plot.y.length); i++) {
    const x = plot.x[i], y = plot.y[i];
    if (x !== null && y !== null && Math.abs(x) < kFarthest && Math.abs(y) < kFarthest)
      points.push([x, y]);
  }
  if (points.length === 0) return null;
  const [x0, x1] = widened(points.map(p => p[0])), [y0, y1] = widened(points.map(p => p[1]));
  const {root, px, py} = frame(
      {least: x0, most: x1, label: plot.x_label}, {least: y0, most: y1, label: plot.y_label},
      plot.title, plot.x_label.startsWith('east'));
  const at = points.map(p => [px(p[0]), py(p[1])]);
  root.append(
      svg('polyline',
          {class: 'line', points: at.map(p => `${p[0].toFixed(1)},${p[1].toFixed(1)}`).join(' ')}));
  if (points.length <= 200)
    for (const p of at)
      root.append(svg('circle', {class: 'dot', cx: p[0].toFixed(1), cy: p[1].toFixed(1), r: 2.4}));
  follow(
      root, at.map(p => p[0]), i => `${shown(points[i][0])}: ${shown(points[i][1])}`,
      at.map(p => p[1]));
  return figure(root, plot.title, '');
}

const share = (count: number, whole: number) => `${shown(100 * count / whole, 3)} %`;

/** Bars between edges, in shares of all that was counted. */
function bars(
    edges: number[], counts: number[], title: string, note: string, label: string, unit: string,
    isLog: boolean): HTMLElement {
  const whole = counts.reduce((sum, count) => sum + count, 0);
  const most = Math.max(...counts) / whole * 100;
  const {root, px, py} = frame(
      {least: edges[0], most: edges[edges.length - 1], isLog, label},
      {least: 0, most: 1.08 * most, label: '% of pixels'}, title);
  counts.forEach((count, i) => {
    const left = px(edges[i]), right = px(edges[i + 1]), top = py(100 * count / whole);
    if (count > 0)
      root.append(svg('rect', {
        class: 'bar',
        x: left + 0.5,
        y: top,
        width: Math.max(0.5, right - left - 1),
        height: kHeight - kBottom - top
      }));
  });
  follow(
      root, counts.map((_, i) => (px(edges[i]) + px(edges[i + 1])) / 2),
      i =>
          `${shown(edges[i], 3)} to ${shown(edges[i + 1], 3)} ${unit}: ${share(counts[i], whole)}`);
  return figure(root, title, note);
}

export const octaves = (of: Octaves, title: string, note: string, label: string, unit: string) =>
    bars(of.edges, of.counts, title, note, label, unit, true);

/** Counts of whole units from 0 on; empty ones at the end are left out. */
export function units(
    counts: number[], title: string, note: string, label: string, unit: string): HTMLElement {
  let size = counts.length;
  while (size > 1 && counts[size - 1] === 0) size--;
  const shownSize = Math.min(counts.length, size + 1);
  return bars(
      [...Array(shownSize + 1).keys()], counts.slice(0, shownSize), title, note, label, unit,
      false);
}

/** Shares of named kinds, the largest first. */
export function kinds(
    list: {name: string; count: number; color: string}[], title: string,
    note: string): HTMLElement {
  const whole = list.reduce((sum, kind) => sum + kind.count, 0);
  const sorted = [...list].sort((a, b) => b.count - a.count);
  return h(
      'figure', {class: 'chart'},
      h('figcaption', {}, h('b', {}, title), h('span', {class: 'soft'}, note)),
      h('table', {class: 'kinds'},
        ...sorted.map(
            kind =>
                h('tr', {},
                  h('th', {scope: 'row'},
                    h('span', {class: 'swatch', style: `background:${kind.color}`}), kind.name),
                  h('td', {class: 'wide-bar'}, h('span', {
                      style: `width:${100 * kind.count / sorted[0].count}%;background:${kind.color}`
                    })),
                  h('td', {class: 'num'}, share(kind.count, whole))))));
}

export interface Series {
  name: string;
  color: string;
  x: number[];
  y: number[]
}
export function lines(
    series: Series[], title: string, note: string, xLabel: string, yLabel: string,
    yUnit: string): HTMLElement {
  const [x0, x1] = widened(series.flatMap(s => s.x)), [y0, y1] = widened(series.flatMap(s => s.y));
  const {root, px, py} =
      frame({least: x0, most: x1, label: xLabel}, {least: y0, most: y1, label: yLabel}, title);
  const all: {px: number; py: number; words: string}[] = [];
  for (const s of series) {
    const at = s.x.map((x, i) => [px(x), py(s.y[i])]);
    root.append(svg('polyline', {
      class: 'line',
      style: `stroke:${s.color}`,
      points: at.map(p => `${p[0].toFixed(1)},${p[1].toFixed(1)}`).join(' ')
    }));
    at.forEach((p, i) => {
      root.append(
          svg('circle', {class: 'dot', style: `fill:${s.color}`, cx: p[0], cy: p[1], r: 2.6}));
      all.push(
          {px: p[0], py: p[1], words: `${s.name}, ${shown(s.x[i])}: ${shown(s.y[i], 3)} ${yUnit}`});
    });
  }
  follow(root, all.map(p => p.px), i => all[i].words, all.map(p => p.py));
  const legend = series.length < 2 ?
      undefined :
      h('div', {class: 'legend'},
        ...series.map(
            s => h(
                'span', {}, h('span', {class: 'swatch', style: `background:${s.color}`}), s.name)));
  return figure(root, title, note, legend);
}
