// The tracks and footprints from above, local frame: x east, y north, m.
import {css, kindColor} from './colors';
import {h, lengthText, shown, svg} from './dom';
import {centreOf} from './geometry';
import type {Selection} from './selection';
import {ticks} from './ticks';

const kWidth = 640, kLeft = 54, kBottom = 40, kTop = 8, kRight = 8;

export function buildMap(selection: Selection): HTMLElement {
  const sequences = selection.data.sequences!;
  const root = svg('svg', {
    class: 'map',
    role: 'group',
    'aria-label': 'map of tracks and footprints; the frame slider chooses the same images'
  });
  const note = h('p', {class: 'note'}), tip = h('output', {class: 'tip'});
  const hiddenCameras = new Set<number>();
  const legend = h('div', {class: 'legend'});
  let drawn = -1;
  let view = {west: 0, east: 1, south: 0, north: 1};
  let polygons = new Map<number, SVGElement>();
  let marker: SVGElement|null = null;

  function draw(number: number) {
    const sequence = sequences[number], map = sequence.map!;
    const width = kWidth - kLeft - kRight, scale = width / (view.east - view.west);
    const whole = (map.north_m - map.south_m) / (map.east_m - map.west_m);
    const height = Math.round(width * whole);
    const px = (x: number) => kLeft + (x - view.west) * scale,
          py = (y: number) => kTop + (view.north - y) * scale;
    root.setAttribute('viewBox', `0 0 ${kWidth} ${kTop + height + kBottom}`);
    const inside = svg('g', {'clip-path': 'url(#map-window)'});
    const clip =
        svg('clipPath', {id: 'map-window'}, svg('rect', {x: kLeft, y: kTop, width, height}));
    root.replaceChildren(
        clip, svg('rect', {class: 'ground', x: kLeft, y: kTop, width, height}), inside);
    if (map.file)
      inside.append(svg('image', {
        href: `page/${map.file}`,
        x: px(map.west_m),
        y: py(map.north_m),
        width: (map.east_m - map.west_m) * scale,
        height: (map.north_m - map.south_m) * scale,
        preserveAspectRatio: 'none'
      }));
    const unit = view.east - view.west > 5000 ? 1000 : 1;
    for (const x of ticks(view.west, view.east, 6))
      root.append(
          svg('line',
              {class: 'tick', x1: px(x), x2: px(x), y1: kTop + height, y2: kTop + height + 4}),
          svg('text', {x: px(x), y: kTop + height + 17, 'text-anchor': 'middle'}, shown(x / unit)));
    for (const y of ticks(view.south, view.north, 6))
      root.append(
          svg('line', {class: 'tick', x1: kLeft - 4, x2: kLeft, y1: py(y), y2: py(y)}),
          svg('text', {x: kLeft - 8, y: py(y) + 4, 'text-anchor': 'end'}, shown(y / unit)));
    const label = unit === 1000 ? 'km' : 'm';
    root.append(
        svg('text',
            {class: 'label', x: kLeft + width / 2, y: kTop + height + 34, 'text-anchor': 'middle'},
            `east, ${label}`),
        svg('text', {
          class: 'label',
          x: 12,
          y: kTop + height / 2,
          'text-anchor': 'middle',
          transform: `rotate(-90 12 ${kTop + height / 2})`
        },
            `north, ${label}`));
    polygons = new Map();
    selection.images.forEach((image, index) => {
      if (image.sequence !== number || hiddenCameras.has(image.camera) ||
          image.footprint.length < 3)
        return;
      const camera = sequence.cameras[image.camera];
      const polygon =
          svg('polygon', {
            class: 'footprint',
            style: `--color:${css(kindColor(image.camera))}`,
            'data-index': index,
            points:
                image.footprint.map(p => `${px(p[0]).toFixed(1)},${py(p[1]).toFixed(1)}`).join(' '),
            pointerenter: () => {
              tip.textContent = `${camera.name}, frame ${image.frame}: click to open`;
            },
            pointerleave: () => {
              tip.textContent = '';
            },
            click: () => {
              if (!dragged) selection.show(index);
            }
          },
              svg('title', {}, `${camera.name}, frame ${image.frame}`));
      polygons.set(index, polygon);
      inside.append(polygon);
    });
    sequence.cameras.forEach((camera, c) => {
      if (hiddenCameras.has(c)) return;
      const points =
          camera.track_poses.map(pose => `${px(pose[3]).toFixed(1)},${py(pose[7]).toFixed(1)}`)
              .join(' ');
      inside.append(
          svg('polyline', {class: 'track under', points}),
          svg('polyline', {class: 'track', style: `stroke:${css(kindColor(c))}`, points}));
    });
    const first = sequence.cameras[0].track_poses[0];
    if (first)
      inside.append(
          svg('circle', {class: 'start', cx: px(first[3]), cy: py(first[7]), r: 5}),
          svg('text', {class: 'start', x: px(first[3]) + 8, y: py(first[7]) - 8}, 'start'));
    // The longest round length within a fifth of the map.
    const raw = (view.east - view.west) / 5, power = 10 ** Math.floor(Math.log10(raw)),
          bar = power * [5, 2, 1].find(f => f * power <= raw)!;
    root.append(
        svg('g', {class: 'scale', transform: `translate(${kLeft + 12} ${kTop + height - 14})`},
            svg('path', {class: 'under', d: `M0-5V0H${bar * scale}V-5`}),
            svg('path', {d: `M0-5V0H${bar * scale}V-5`}),
            svg('text', {class: 'under', x: bar * scale / 2, y: -6, 'text-anchor': 'middle'},
                lengthText(bar)),
            svg('text', {x: bar * scale / 2, y: -6, 'text-anchor': 'middle'}, lengthText(bar))));
    marker = svg('circle', {class: 'here', r: 6});
    inside.append(marker);
    markSelected();
  }

  function markSelected() {
    polygons.forEach(
        (polygon, index) =>
            polygon.classList.toggle('selected', index === selection.current.index));
    const polygon = polygons.get(selection.current.index), image = selection.image;
    polygon?.parentNode?.insertBefore(polygon, marker);
    const map = image && sequences[image.sequence].map;
    if (!marker || !map) return;
    marker.setAttribute('visibility', image.pose ? 'visible' : 'hidden');
    if (!image.pose) return;
    const scale = (kWidth - kLeft - kRight) / (view.east - view.west), at = centreOf(image.pose);
    marker.setAttribute('cx', String(kLeft + (at[0] - view.west) * scale));
    marker.setAttribute('cy', String(kTop + (view.north - at[1]) * scale));
  }

  function whole(number: number) {
    const map = sequences[number].map!;
    view = {west: map.west_m, east: map.east_m, south: map.south_m, north: map.north_m};
  }
  function zoom(by: number, x = (view.west + view.east) / 2, y = (view.south + view.north) / 2) {
    const map = sequences[drawn].map!;
    const factor =
        Math.max(by, (map.east_m - map.west_m) / 40 / (view.east - view.west));  // 40 times at most
    view = {
      west: x + (view.west - x) * factor,
      east: x + (view.east - x) * factor,
      south: y + (view.south - y) * factor,
      north: y + (view.north - y) * factor
    };
    if (view.east - view.west >= map.east_m - map.west_m) whole(drawn);
    draw(drawn);
  }

  let dragged = false, from: {x: number; y: number; view: typeof view}|null = null;
  const metresPerScreenPixel = () => (view.east - view.west) / (kWidth - kLeft - kRight) * kWidth /
      root.getBoundingClientRect().width;
  root.addEventListener('pointerdown', event => {
    from = {x: event.clientX, y: event.clientY, view};
    dragged = false;
  });
  window.addEventListener('pointerup', () => {
    from = null;
  });
  root.addEventListener('pointermove', event => {
    if (!from || event.buttons === 0 ||
        Math.hypot(event.clientX - from.x, event.clientY - from.y) < 4)
      return;
    dragged = true;
    const m = metresPerScreenPixel(), dx = (event.clientX - from.x) * m,
          dy = (event.clientY - from.y) * m;
    view = {
      west: from.view.west - dx,
      east: from.view.east - dx,
      south: from.view.south + dy,
      north: from.view.north + dy
    };
    draw(drawn);
  });
  // A wheel alone scrolls the page.
  root.addEventListener('wheel', event => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    const box = root.getBoundingClientRect(), m = metresPerScreenPixel(), k = box.width / kWidth;
    zoom(
        event.deltaY > 0 ? 1.25 : 0.8, view.west + (event.clientX - box.left - kLeft * k) * m,
        view.north - (event.clientY - box.top - kTop * k) * m);
  }, {passive: false});

  function showLegend(number: number) {
    const sequence = sequences[number];
    legend.replaceChildren(...sequence.cameras.map(
        (camera, c) => h(
            'label', {}, h('input', {
              type: 'checkbox',
              checked: !hiddenCameras.has(c),
              change: () => {
                if (!hiddenCameras.delete(c)) hiddenCameras.add(c);
                draw(number);
              }
            }),
            h('span', {class: 'swatch', style: `background:${css(kindColor(c))}`}), camera.name)));
  }

  selection.follow(() => {
    const number = selection.image.sequence;
    if (!sequences[number].map) return;
    if (number !== drawn) {
      drawn = number;
      whole(number);
      const source = sequences[number].map!.source;
      note.textContent =
          `Where each camera flew and what its images show of the ground, cut off beyond ${
              selection.data.far_depths} times the image's median depth. Below: ${{
            world: 'the world, hillshaded',
            depth: 'the images\' own depth, shaded and tinted by their colours',
            none: 'nothing, there is no depth'
          }[source]}.`;
      showLegend(number);
      draw(number);
    } else
      markSelected();
  });

  const button = (text: string, label: string, click: () => void) =>
      h('button', {type: 'button', 'aria-label': label, title: label, click}, text);
  return h(
      'section', {id: 'map'}, h('h2', {}, 'Map'), note,
      h('div', {class: 'framed'}, root,
        h('div', {class: 'bar'}, button('−', 'map smaller', () => zoom(1.5)),
          button('+', 'map larger', () => zoom(1 / 1.5)),
          button(
              'whole', 'whole map',
              () => {
                whole(drawn);
                draw(drawn);
              }),
          tip),
        legend));
}
