// The page's modules by themselves: numbers, colours, ticks, normals.
//   node modules_test.mjs PAGE_PACKAGES
import assert from 'node:assert/strict';
import {mkdtempSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {dirname, join, resolve} from 'node:path';
import {after, test} from 'node:test';
import {fileURLToPath, pathToFileURL} from 'node:url';

const packages = resolve(process.env.TERRACAST_PAGE_PACKAGES);
const source = join(dirname(fileURLToPath(import.meta.url)), '../../validate/page/src');
const folder = mkdtempSync(join(tmpdir(), 'terracast-page-modules-'));
after(() => rmSync(folder, {recursive: true}));
const {build} = createRequire(join(packages, 'x.js'))('esbuild');
async function load(name) {
  const outfile = join(folder, `${name}.mjs`);
  await build({
    entryPoints: [join(source, `${name}.ts`)],
    bundle: true,
    format: 'esm',
    outfile,
    logLevel: 'error'
  });
  return import(pathToFileURL(outfile));
}

const {ticks, logTicks} = await load('ticks');
const {viridis, diverging, flowColor, kindColor} = await load('colors');
const {fromPlanes, unpacked} = await load('values');
const {normalAt, pixelOf} = await load('geometry');

test('Ticks are round, inside, and few for any numbers', () => {
  assert.deepEqual(ticks(0, 10, 5), [0, 2, 4, 6, 8, 10]);
  assert.deepEqual(ticks(-0.3, 0.3, 3).map(v => +v.toFixed(9)), [-0.2, 0, 0.2]);
  for (const size of [4e18, 4e299, 1e-300, -4e18])
    assert.ok(ticks(size, size * (1 + Math.sign(size) * 2e-16), 4).length <= 9);
  for (const [a, b] of [[1, 1], [NaN, 1], [0, Infinity], [2, 1]])
    assert.deepEqual(ticks(a, b, 4), []);
  assert.deepEqual(logTicks(1, 20), [1, 2, 5, 10, 20].filter(v => v <= 20));
});

test('Viridis is the published map within five levels', () => {
  // Eight of its colours, evenly spaced.
  ['440154', '46327e', '365c8d', '277f8e', '1fa187', '4ac16d', 'a0da39', 'fde725'].forEach(
      (hex, k) => {
        const rgb = [0, 2, 4].map(at => parseInt(hex.slice(at, at + 2), 16));
        viridis(k / 7).forEach(
            (value, c) => assert.ok(Math.abs(value - rgb[c]) <= 5, `${k}: ${viridis(k / 7)}`));
      });
  // Lighter all the way: it can be read without colours.
  const luma = t => {
    const [r, g, b] = viridis(t);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  for (let t = 0; t < 1; t += 0.02) assert.ok(luma(t + 0.02) > luma(t));
  assert.deepEqual(diverging(0), [247, 247, 247]);
  assert.deepEqual(diverging(-9), [5, 48, 97]);
});

test('Flow has the hues of Baker et al.', () => {
  assert.deepEqual(flowColor(0, 0), [255, 255, 255]);
  assert.deepEqual(flowColor(1, 0), [255, 0, 0]);  // right: the wheel's first colour
  const [r, g, b] = flowColor(0, 1);               // down: a quarter on, yellow
  assert.ok(r > 200 && g > 200 && b < 30, `${[r, g, b]}`);
  const left = flowColor(-1, 0);  // left: half on, cyan to blue
  assert.ok(left[0] < 20 && left[2] > 230, `${left}`);
  assert.ok(flowColor(0.5, 0)[1] > 120);  // shorter is paler
  assert.ok(flowColor(3, 0)[0] < 200);    // beyond the rim darker
  assert.notDeepEqual(kindColor(0), kindColor(8));
});

test('Planes of bytes become the very values', async () => {
  const bits = new Uint32Array(new Float32Array([1.5, -2.25, NaN, Infinity, 0.1]).buffer);
  const count = bits.length, planes = new Uint8Array(4 * count);
  let before = 0;
  bits.forEach((value, i) => {
    const difference = (value - before) >>> 0;
    before = value;
    for (let k = 0; k < 4; k++) planes[k * count + i] = difference >>> 8 * k & 255;
  });
  const values = fromPlanes(planes, 'f32', count);
  assert.deepEqual(new Uint32Array(values.buffer), bits);
  assert.deepEqual([...fromPlanes(Uint8Array.of(255, 1, 255, 0), 'i16', 2)], [-1, 0]);
  const {deflateSync} = await import('node:zlib');
  const packed = {
    type: 'u8',
    count: 3,
    data: deflateSync(Uint8Array.of(200, 100, 1)).toString('base64')
  };
  assert.deepEqual([...await unpacked(packed)], [200, 44, 45]);
});

test('The normal of a level and of a slanted plane stands on it', () => {
  const image = {
    width: 5,
    height: 5,
    step: 2,
    pose: [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 100]
  };  // looks down, north is up in the image
  const camera = {width_px: 10, height_px: 10, fx_px: 20, fy_px: 20, cx_px: 5, cy_px: 5};
  const level = new Float32Array(25).fill(100);
  normalAt(camera, image, level, 2, 2)
      .forEach((value, k) => assert.ok(Math.abs(value - [0, 0, 1][k]) < 1e-6));
  assert.equal(normalAt(camera, image, level, 0, 2), null);
  // Ground that rises by a half of each metre to the east: z = x / 2, so depth d = 100 - z, x = ray d.
  const slanted = Float64Array.from({length: 25}, (_, i) => {
    const ray = (pixelOf(image, i % 5) + 0.5 - 5) / 20;
    return 100 / (1 + ray / 2);
  });
  const expected = [-0.5, 0, 1].map(v => v / Math.hypot(0.5, 1));
  normalAt(camera, image, slanted, 2, 2)
      .forEach((value, k) => assert.ok(Math.abs(value - expected[k]) < 1e-6));
});
