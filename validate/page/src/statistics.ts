// Histograms, and what the dataset and its making cost.
import {kinds, lines, octaves, units} from './charts';
import {css, kindColor} from './colors';
import {bytesText, durationText, h} from './dom';
import {classColor} from './layers';
import type {Data} from './types';

export function buildHistograms(data: Data): HTMLElement|null {
  const statistics = data.statistics, sequences = data.sequences ?? [], images = data.images ?? [];
  if (!statistics) return null;
  const charts: HTMLElement[] = [];
  if (statistics.depth_m)
    charts.push(octaves(
        statistics.depth_m, 'Depth', 'of pixels that have one',
        'depth, m (logarithmic, four bins to each doubling)', 'm'));
  if (statistics.flow_px)
    charts.push(octaves(
        statistics.flow_px, 'Length of the flow', 'to the next frame',
        'flow, px (logarithmic, four bins to each doubling)', 'px'));
  if (statistics.slope_deg)
    charts.push(units(
        statistics.slope_deg, 'Slope of the ground',
        'by the depth of neighbouring pixels, against the origin\'s vertical; by pixels, so that near ground counts more',
        'slope, degrees', '°'));
  const overlap = statistics.overlap.filter(list => list.frames.length > 1);
  if (overlap.length)
    charts.push(lines(
        overlap.map((list, i) => ({
                      name: `${sequences.length > 1 ? `${sequences[list.sequence].name}: ` : ''}${
                          sequences[list.sequence].cameras[list.camera].name}`,
                      // A camera's own colour, but where it flew several sequences.
                      color: css(kindColor(sequences.length > 1 ? i : list.camera)),
                      x: list.frames,
                      y: list.shares.map(share => 100 * share)
                    })),
        'Overlap', 'share of an image\'s ground that the camera\'s next frame has in view', 'frame',
        'overlap, %', '%'));
  if (statistics.classes.length) {
    const ids = new Map(sequences.flatMap(
        sequence =>
            Object.entries(sequence.classes)
                .map(([id, name]) => [name, css(classColor(sequence, Number(id)))] as const)));
    charts.push(kinds(
        statistics.classes.map(
            (kind, i) => ({...kind, color: ids.get(kind.name) ?? css(kindColor(i))})),
        'Classes', 'share of all pixels'));
  }
  if (!charts.length) return null;
  return h(
      'section', {id: 'histograms'}, h('h2', {}, 'Histograms'),
      h('p', {class: 'note'},
        `Over the ${images.length} images of this page, at the places of their views.`),
      h('div', {class: 'charts'}, ...charts));
}

export function buildCosts(data: Data): HTMLElement|null {
  const sizes = data.sizes ?? [];
  if (!sizes.length && !data.stages.length) return null;
  const bytes = sizes.reduce((sum, size) => sum + size.bytes, 0),
        files = sizes.reduce((sum, size) => sum + size.files, 0);
  const sizeTable = h(
      'table', {},
      h('thead', {},
        h('tr', {}, h('th', {scope: 'col'}, 'kind'), h('th', {scope: 'col', class: 'num'}, 'files'),
          h('th', {scope: 'col', class: 'num'}, 'size'))),
      h('tbody', {},
        ...[...sizes]
            .sort((a, b) => b.bytes - a.bytes)
            .map(
                size =>
                    h('tr', {}, h('td', {}, size.kind), h('td', {class: 'num'}, String(size.files)),
                      h('td', {class: 'num'}, bytesText(size.bytes)))),
        h('tr', {class: 'sum'}, h('td', {}, 'all'), h('td', {class: 'num'}, String(files)),
          h('td', {class: 'num'}, bytesText(bytes)))));
  const stageTable = h(
      'table', {},
      h('thead', {},
        h('tr', {}, h('th', {scope: 'col'}, 'stage'), h('th', {scope: 'col', class: 'num'}, 'time'),
          h('th', {scope: 'col', class: 'num'}, 'of CPU'),
          h('th', {scope: 'col', class: 'num'}, 'memory so far'))),
      h('tbody', {},
        ...data.stages.map(
            stage =>
                h('tr', {}, h('td', {}, stage.stage),
                  h('td', {class: 'num'}, durationText(stage.wall_s)),
                  h('td', {class: 'num'}, durationText(stage.cpu_s)),
                  h('td', {class: 'num'}, bytesText(stage.peak_bytes))))));
  return h(
      'section', {id: 'costs'}, h('h2', {}, 'Sizes and times'),
      h('div', {class: 'charts'},
        sizes.length > 0 &&
            h('div', {class: 'wide'},
              h('p', {class: 'note'}, 'Files of the dataset by what they hold.'), sizeTable),
        data.stages.length > 0 &&
            h('div', {class: 'wide'},
              h('p', {class: 'note'}, 'What the stages of the run took, each when it last ran.'),
              stageTable)));
}
