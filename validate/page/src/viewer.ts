// An image, layer by layer, with the values under the pointer.
import {css, kindColor} from './colors';
import {everyText, h, lengthText, shown, svg} from './dom';
import {isUsable, normalAt, pixelOf, pointAt, toLocal} from './geometry';
import {className, cross, kLayers, kMaskWords, kNoResidual} from './layers';

import {layersOf, type Layers} from './load';
import type {Selection} from './selection';
import type {Check} from './types';

const picture = (file: string): Promise<HTMLImageElement|null> => new Promise(resolve => {
  const image = new Image();
  image.onload = () => resolve(image);
  image.onerror = () => resolve(null);
  image.src = `page/${file}.png`;
});

export function buildViewer(selection: Selection): HTMLElement {
  const data = selection.data, sequences = data.sequences!;
  let layerName = 'color', blend = 1, zoom = 1;
  let onStage = selection.image;  // the image that layers and colours are of
  let layers: Layers = {}, colors: HTMLImageElement|null = null;
  let cursor: [number, number]|null = null;  // in the grid
  let isHeld = false;                        // stays although the pointer moves
  let offset: [number, number] = [0, 0];     // of the picture's middle, in its own sizes

  const canvas = h('canvas', {class: 'picture', tabindex: 0, role: 'img'});
  const marks = svg('svg', {class: 'marks', 'aria-hidden': 'true'});
  const inner = h('div', {class: 'inner'}, canvas, marks);
  const stage = h('div', {class: 'stage'}, inner);
  const legend = h('div', {class: 'layer-legend', 'aria-live': 'polite'});
  const readout = h('table', {class: 'readout', 'aria-label': 'values of the pixel'});
  const about = h('p', {class: 'about-image', 'aria-live': 'polite'});
  const worsts = h('p', {class: 'worsts'});
  const slider = h('input', {
    type: 'range',
    min: 0,
    step: 1,
    'aria-label': 'frame',
    input: () => step(Number(slider.value))
  });
  const frameText = h('output', {class: 'frame-text'});
  const cameras = h('div', {class: 'choices cameras', role: 'radiogroup', 'aria-label': 'camera'});
  const layerChoices =
      h('div', {class: 'choices layers', role: 'radiogroup', 'aria-label': 'layer'});
  const blendSlider = h('input', {
    type: 'range',
    min: 0,
    max: 100,
    value: 100,
    'aria-label': 'opacity of the layer over the colours',
    input: () => {
      blend = Number(blendSlider.value) / 100;
      draw();
    }
  });
  const blendLabel = h('label', {class: 'blend'}, 'over the colours', blendSlider);
  const sequenceChoice =
      h('select', {
        'aria-label': 'sequence',
        change: () => {
          const index =
              selection.images.findIndex(image => image.sequence === Number(sequenceChoice.value));
          selection.show(index);
        }
      },
        ...sequences.map(
            (sequence, i) => selection.images.some(image => image.sequence === i) ?
                h('option', {value: i}, sequence.name) :
                null));

  /** One of several, as buttons of which the arrow keys choose. */
  function choices(
      group: HTMLElement, list: {key: string; title: string; swatch?: string}[], chosen: string,
      choose: (key: string) => void) {
    group.replaceChildren(...list.map(
        ({key, title, swatch}) =>
            h('button', {
              type: 'button',
              role: 'radio',
              'aria-checked': key === chosen ? 'true' : 'false',
              tabindex: key === chosen ? 0 : -1,
              'data-key': key,
              click: () => choose(key),
              keydown: (event: KeyboardEvent) => {
                const by = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
                if (!by) return;
                event.preventDefault();
                const next =
                    list[(list.findIndex(entry => entry.key === key) + by + list.length) % list.length]
                        .key;
                choose(next);
                (group.querySelector('[aria-checked=true]') as HTMLElement | null)?.focus();
              },
            },
              swatch && h('span', {class: 'swatch', style: `background:${swatch}`}), title)));
  }

  const ofThis = () => selection.ofCamera(selection.image.sequence, selection.image.camera);
  function step(to: number) {
    const list = ofThis();
    selection.show(list[Math.min(Math.max(to, 0), list.length - 1)]);
  }

  function setLayer(name: string) {
    layerName = name;
    showLayerChoices();
    draw();
  }

  function available(): string[] {
    const image = onStage;
    return Object.keys(kLayers).filter(
        name => kLayers[name].needs === '' ? image.has_color :
                                             image.layers.includes(kLayers[name].needs));
  }
  /** The wanted layer, or the first that the image has. */
  const shownLayer = () => available().includes(layerName) ? layerName : available()[0] ?? 'color';

  function showLayerChoices() {
    choices(
        layerChoices, available().map(key => ({key, title: kLayers[key].title})), shownLayer(),
        setLayer);
    blendLabel.hidden = shownLayer() === 'color' || !onStage.has_color;
  }

  function draw() {
    const image = onStage, sequence = sequences[image.sequence],
          camera = sequence.cameras[image.camera];
    const layer = kLayers[shownLayer()];
    canvas.width = image.width;
    canvas.height = image.height;
    const context = canvas.getContext('2d')!;
    const hasLayer = layer.needs !== '' && layers[layer.needs];
    if (colors && (!hasLayer || blend < 1))
      context.drawImage(colors, 0, 0, image.width, image.height);
    legend.replaceChildren();
    if (hasLayer) {
      const result = layer.paint(image, camera, sequence, layers);
      if (result.picture) {
        const sheet = h('canvas', {width: image.width, height: image.height});
        sheet.getContext('2d')!.putImageData(result.picture, 0, 0);
        context.globalAlpha = blend;
        context.drawImage(sheet, 0, 0);
        context.globalAlpha = 1;
      }
      legend.append(...result.legend);
    }
    canvas.classList.toggle('values', Boolean(hasLayer));
    canvas.setAttribute(
        'aria-label',
        `${layer.title} of ${camera.name}, frame ${
            image.frame}; arrow keys move the read-out, page up and down change the frame`);
    drawMarks();
  }

  function drawMarks() {
    const image = onStage, pixel = image === selection.image ? selection.current.pixel : null;
    marks.setAttribute('viewBox', `0 0 ${image.width} ${image.height}`);
    const size =
        Math.max(image.width, 1) / Math.max(stage.clientWidth, 1) / zoom;  // a screen pixel
    marks.replaceChildren();
    if (pixel)
      marks.append(
          cross((pixel[0] + 0.5) / image.step, (pixel[1] + 0.5) / image.step, 1.15 * size));
    if (cursor)
      marks.append(svg('rect', {
        class: isHeld ? 'cursor held' : 'cursor',
        x: cursor[0],
        y: cursor[1],
        width: 1,
        height: 1,
        'stroke-width': 1.5 * size
      }));
    inner.style.transform = `scale(${zoom}) translate(${100 * offset[0]}%, ${100 * offset[1]}%)`;
  }

  function showReadout() {
    const image = onStage, sequence = sequences[image.sequence],
          camera = sequence.cameras[image.camera];
    const rows: [string, string][] = [];
    if (cursor) {
      const [i, j] = cursor, at = j * image.width + i, count = image.width * image.height;
      rows.push(['pixel', `(${pixelOf(image, i)}, ${pixelOf(image, j)})`]);
      if (layers.depth) {
        const depth_m = layers.depth[at];
        rows.push(['depth', Number.isFinite(depth_m) ? `${shown(depth_m, 8)} m` : 'none']);
        const point = isUsable(camera) ? pointAt(camera, image, layers.depth, i, j) : null;
        if (point) rows.push(['range', `${shown(Math.hypot(...point), 8)} m`]);
        if (point && image.pose) {
          const local = toLocal(image.pose, point);
          rows.push([
            'east, north, up', `${local.map(v => v.toFixed(2).replace('-', '−')).join(', ')} m`
          ]);
          const normal = isUsable(camera) ? normalAt(camera, image, layers.depth, i, j) : null;
          if (normal)
            rows.push([
              'slope', `${shown(Math.acos(Math.min(1, Math.abs(normal[2]))) * 180 / Math.PI, 3)}°`
            ]);
        }
      }
      if (layers.flow) {
        const u = layers.flow[at], v = layers.flow[count + at];
        rows.push(['flow', Number.isFinite(u) ? `(${shown(u, 7)}, ${shown(v, 7)}) px` : 'none']);
      }
      if (layers.masks) rows.push(['next frame', kMaskWords[layers.masks[at] & 3]]);
      if (layers.classes)
        rows.push(['class', `${className(sequence, layers.classes[at])} (${layers.classes[at]})`]);
      if (layers.disparity)
        rows.push([
          'disparity',
          Number.isFinite(layers.disparity[at]) ? `${shown(layers.disparity[at], 8)} px` : 'none'
        ]);
      if (layers.residual) {
        const r = layers.residual[at];
        rows.push([
          'residual',
          r === kNoResidual ? 'none' :
                              `${Math.abs(r) === 32767 ? 'beyond ' : ''}${shown(r, 6)} millionths`
        ]);
      }
    }
    readout.replaceChildren(...rows.map(
        ([name, value]) => h('tr', {}, h('th', {scope: 'row'}, name), h('td', {}, value))));
  }

  function moveCursor(to: [number, number]|null) {
    cursor = to;
    showReadout();
    drawMarks();
  }
  function gridAt(event: PointerEvent): [number, number]|null {
    const box = canvas.getBoundingClientRect(), image = onStage;
    const i = Math.floor((event.clientX - box.left) / box.width * image.width),
          j = Math.floor((event.clientY - box.top) / box.height * image.height);
    return i >= 0 && j >= 0 && i < image.width && j < image.height ? [i, j] : null;
  }

  function setZoom(to: number, about: [number, number]|null = cursor) {
    zoom = Math.min(Math.max(to, 1), 16);
    const image = onStage;
    if (about)
      offset = [0.5 - (about[0] + 0.5) / image.width, 0.5 - (about[1] + 0.5) / image.height];
    clampOffset();
    drawMarks();
  }
  function clampOffset() {
    const most = 0.5 - 0.5 / zoom;
    offset = offset.map(v => Math.min(Math.max(v, -most), most)) as [number, number];
  }

  let drag: {x: number; y: number; offset: [number, number]; moved: boolean}|null = null;
  canvas.addEventListener('pointerdown', event => {
    drag = {x: event.clientX, y: event.clientY, offset, moved: false};
  });
  window.addEventListener('pointerup', () => {
    setTimeout(() => {
      drag = null;
    });
  });
  canvas.addEventListener('pointermove', event => {
    if (drag && event.buttons && zoom > 1) {
      const box = canvas.getBoundingClientRect();
      const by = [(event.clientX - drag.x) / box.width, (event.clientY - drag.y) / box.height];
      drag.moved ||= Math.hypot(event.clientX - drag.x, event.clientY - drag.y) > 4;
      offset = [drag.offset[0] + by[0], drag.offset[1] + by[1]];
      clampOffset();
      drawMarks();
    } else if (!isHeld)
      moveCursor(gridAt(event) ?? cursor);
  });
  canvas.addEventListener('click', event => {
    if (drag?.moved) return;
    const at = gridAt(event as PointerEvent);
    isHeld = !(isHeld && cursor && at && cursor[0] === at[0] && cursor[1] === at[1]);
    moveCursor(at);
  });
  canvas.addEventListener('keydown', event => {
    const image = onStage,
          by = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [
                  0, 1
                ]}[event.key];
    if (by) {
      const from = cursor ?? [image.width >> 1, image.height >> 1],
            stride = event.shiftKey ? 10 : 1;
      isHeld = true;
      moveCursor([
        Math.min(Math.max(from[0] + stride * by[0], 0), image.width - 1),
        Math.min(Math.max(from[1] + stride * by[1], 0), image.height - 1)
      ]);
    } else if (event.key === 'PageDown' || event.key === 'PageUp')
      step(Number(slider.value) + (event.key === 'PageDown' ? 1 : -1));
    else if (event.key === '+' || event.key === '=')
      setZoom(2 * zoom);
    else if (event.key === '-')
      setZoom(zoom / 2);
    else if (event.key === 'Escape') {
      isHeld = false;
      drawMarks();
    } else
      return;
    event.preventDefault();
  });
  new ResizeObserver(() => {
    if (onStage) drawMarks();
  }).observe(stage);

  /** The checks whose worst value stands in this image. */
  function showWorsts() {
    const here = data.report.checks.filter(
        check => check.place && selection.placeOf(check) === selection.current.index);
    worsts.replaceChildren(
        ...(here.length ?
                [
                  'Worst place of ',
                  ...here.flatMap(
                      (check: Check, i: number) =>
                          [i ? ', ' : '',
                           h('button', {
                             type: 'button',
                             class: check === selection.current.check ? 'link here' : 'link',
                             'data-check': check.name,
                             click: () => selection.showCheck(check)
                           },
                             check.name)]),
                  '.'
                ] :
                []));
    worsts.hidden = here.length === 0;
  }

  let turn = 0;
  selection.follow(async selected => {
    const image = selection.image, sequence = sequences[image.sequence],
          camera = sequence.cameras[image.camera];
    const mine = ++turn;
    const list = ofThis();
    slider.max = String(list.length - 1);
    slider.value = String(list.indexOf(selected.index));
    slider.setAttribute('aria-valuetext', `frame ${image.frame}`);
    frameText.textContent = `frame ${image.frame} of ${sequence.num_frames}`;
    sequenceChoice.value = String(image.sequence);
    const shownCameras =
        [...new Set(selection.images.filter(other => other.sequence === image.sequence)
                        .map(other => other.camera))];
    choices(
        cameras,
        shownCameras.map(
            c => ({key: String(c), title: sequence.cameras[c].name, swatch: css(kindColor(c))})),
        String(image.camera),
        key => selection.show(selection.nearest(image.sequence, Number(key), image.frame)));
    about.replaceChildren(
        `${camera.width_px} × ${camera.height_px} px`,
        image.step > 1 ? `, ${everyText(image.step)} pixel of it here` : '',
        image.median_depth_m > 0 ? `; median depth ${lengthText(image.median_depth_m)}` : '',
        list.length < sequence.num_frames ?
            `; ${list.length} of this camera's ${sequence.num_frames} frames are on this page` :
            '');
    showWorsts();
    const [values, loaded] = await Promise.all([
      layersOf(selected.index, image)
          .catch((error: Error) => (about.append(`; ${error.message}`), {} as Layers)),
      image.has_color ? picture(image.file) : null
    ]);
    if (mine !== turn) return;
    onStage = image;
    layers = values;
    colors = loaded;
    isHeld = Boolean(selected.pixel);
    cursor = selected.pixel ?
        [
          Math.min(Math.floor(selected.pixel[0] / image.step), image.width - 1),
          Math.min(Math.floor(selected.pixel[1] / image.step), image.height - 1)
        ] :
        cursor && cursor[0] < image.width && cursor[1] < image.height ?
        cursor :
        [image.width >> 1, 2 * image.height / 3 | 0];
    inner.style.aspectRatio = `${image.width} / ${image.height}`;
    stage.style.setProperty('--aspect', String(image.width / image.height));
    showLayerChoices();
    draw();
    showReadout();
    root.dataset.shown = String(selected.index);
  });

  const button = (text: string, label: string, click: () => void) =>
      h('button', {type: 'button', 'aria-label': label, title: label, click}, text);
  const root = h(
      'section', {id: 'frames'}, h('h2', {}, 'Frames'),
      h('p', {class: 'note'},
        `${selection.images.length} of ${
            data.num_images} images, evenly spaced, with the worst of each check. Colours are means; all values are those of the file, exactly, at the middle pixel of each place${
            selection.images.some(image => image.step > 1) ?
                ` (images wider than ${data.image_px} px are shown at every n-th pixel)` :
                ''}.`),
      h('div', {class: 'viewer'},
        h('div', {class: 'bar'}, sequenceChoice.options.length > 1 && sequenceChoice, cameras),
        h('div', {class: 'bar'}, layerChoices, blendLabel),
        h('div', {class: 'look'},
          h('div', {class: 'left'}, stage,
            h('div', {class: 'bar frames'},
              button('‹', 'frame before', () => step(Number(slider.value) - 1)), slider,
              button('›', 'next frame', () => step(Number(slider.value) + 1)), frameText,
              h('span', {class: 'zoom'}, button('−', 'smaller', () => setZoom(zoom / 2)),
                button('+', 'larger', () => setZoom(2 * zoom))))),
          h('div', {class: 'side'}, about, worsts, readout,
            h('p', {class: 'soft hint'},
              'Point at a pixel for its values; click to hold it, click again to let go.'),
            legend))));
  return root;
}
