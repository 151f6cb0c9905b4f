// Opens reports in headless Chromium, as a reader would: from files, without a network.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {cpSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';
import {after, test} from 'node:test';
import {pathToFileURL} from 'node:url';

const chromiumPath = process.env.CHROMIUM ?? '/usr/bin/chromium';
if (!existsSync(chromiumPath)) {
  console.log(`skipped: ${chromiumPath} is missing; scripts/install test`);
  process.exit(0);
}
const {chromium} =
    createRequire(join(resolve(process.env.TERRACAST_TEST_PACKAGES), 'x.js'))('playwright-core');
const folder = mkdtempSync(join(tmpdir(), 'terracast-page-'));
execFileSync(process.env.TERRACAST_PAGE_FIXTURE, [folder], {stdio: 'inherit'});
const truth = JSON.parse(readFileSync(join(folder, 'truth.json'), 'utf8'));
const shots = process.env.TERRACAST_PAGE_SHOTS;  // a folder for what the pages look like

// A profile of its own is made for each launch, and removed.
const browser = await chromium.launch({
  executablePath: chromiumPath,
  headless: true,
  args: [
    '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'
  ]
});
after(async () => {
  await browser.close();
  rmSync(folder, {recursive: true});
});

/** Opens a page of the report; every complaint of it, and every request beyond files, fails the test. */
async function open(report, options = {}) {
  const context =
      await browser.newContext({viewport: {width: 1400, height: 900}, offline: true, ...options});
  context.setDefaultTimeout(120e3);  // a busy machine draws slowly
  const page = await context.newPage();
  const wrong = [];
  page.on('pageerror', error => wrong.push(error.message));
  // The software renderer warns that reading a picture back is slow.
  page.on('console', message => {
    if (['error', 'warning'].includes(message.type()) && !message.text().includes('GPU stall'))
      wrong.push(message.text());
  });
  page.on('request', request => {
    if (!/^(file|data|blob):/.test(request.url())) wrong.push(`asks for ${request.url()}`);
  });
  page.on('requestfailed', request => wrong.push(`cannot get ${request.url()}`));
  await page.goto(pathToFileURL(join(folder, report, 'index.html')).href);
  return {
    page,
    wrong,
    close: async () => {
      assert.deepEqual(wrong, []);
      await context.close();
    }
  };
}

/** The read-out as an object; waits until the viewer shows an image. */
async function readout(page) {
  await page.waitForSelector('#frames[data-shown]');
  return Object.fromEntries(await page.$$eval(
      '.readout tr',
      rows => rows.map(row => [row.children[0].textContent, row.children[1].textContent])));
}
const numbers = text => text.replaceAll('−', '-').match(/-?\d+(\.\d+)?(e-?\d+)?/g).map(Number);
const shownFrame = async page => numbers(await page.textContent('.frame-text'))[0];

/** Points at a pixel of the whole image. */
async function pointAt(page, x, y, size) {
  await page.locator('.picture').scrollIntoViewIfNeeded();
  const box = await page.locator('.picture').boundingBox();
  await page.mouse.move(
      box.x + (x + 0.5) / size.width * box.width, box.y + (y + 0.5) / size.height * box.height);
}

test('A check leads to its worst pixel, and the read-out is the true value', async () => {
  const {page, close} = await open('report/kitti');
  // The page starts at what is wrong; go elsewhere first.
  await page.waitForSelector('#frames[data-shown]');
  await page.locator('.frames input[type=range]').fill('0');
  await page.waitForFunction(
      () => document.querySelector('.frame-text').textContent.startsWith('frame 0'));
  await page.click('#checks tr[data-check=stereo_disparity] button.place');
  await page.waitForFunction(
      () => document.querySelector('.frame-text').textContent.startsWith('frame 1'));
  await page.waitForSelector('.marks .cross');
  const values = await readout(page);
  assert.equal(values.pixel, `(${truth.kitti.x}, ${truth.kitti.y})`);
  // Eight digits are shown.
  assert.ok(Math.abs(numbers(values.depth)[0] / truth.kitti.depth_m - 1) < 1e-7, values.depth);
  assert.equal(await page.getAttribute('.cameras [aria-checked=true]', 'data-key'), '0');
  assert.match(await page.textContent('.worsts'), /stereo_disparity/);
  await close();
});

test(
    'Depth and flow under the pointer are the true ones where every second pixel is shown',
    async () => {
      const {page, close} = await open('report/tartanair');
      await page.waitForSelector('#frames[data-shown]');
      for (const expected of truth.tartanair) {
        await page.locator('.frames input[type=range]').fill(String(expected.frame));
        await page.waitForFunction(
            frame => document.querySelector('.frame-text').textContent.startsWith(`frame ${frame}`),
            expected.frame);
        await page.waitForTimeout(300);
        await pointAt(page, expected.x, expected.y, {width: 640, height: 640});
        const values = await readout(page);
        assert.equal(values.pixel, `(${expected.x}, ${expected.y})`);
        assert.ok(Math.abs(numbers(values.depth)[0] / expected.depth_m - 1) < 1e-7, values.depth);
        // float32 of some 100 px, shown with seven digits.
        numbers(values.flow)
            .forEach(
                (value, k) => assert.ok(
                    Math.abs(value - expected.flow_px[k]) < 1e-4,
                    `${values.flow} is not ${expected.flow_px}`));
        assert.match(values.class, /ground \(1\)/);
      }
      await close();
    });

test('Layers, cameras, frames and keys change the picture', async () => {
  const {page, close} = await open('report/tartanair');
  await page.waitForSelector('#frames[data-shown]');
  const picture = () => page.$eval('.picture', canvas => {
    // A canvas with a picture from a file may be looked at, but not read; a layer of values may.
    try {
      return canvas.toDataURL();
    } catch {
      return 'colours';
    }
  });
  assert.equal(await picture(), 'colours');
  const seen = new Set();
  for (const layer of ['depth', 'normals', 'flow', 'classes', 'masks', 'residual']) {
    await page.click(`.layers [data-key=${layer}]`);
    seen.add(await page.$eval('.layer-legend', legend => legend.textContent));
    assert.equal(await page.getAttribute(`.layers [data-key=${layer}]`, 'aria-checked'), 'true');
  }
  assert.equal(seen.size, 6, 'each layer has its own legend');
  await page.click('.cameras [data-key="1"]');
  await page.waitForFunction(
      () => document.querySelector('.picture').getAttribute('aria-label').includes('rcam_front'));
  // The right camera has no flow.
  assert.equal(await page.$('.layers [data-key=flow]'), null);
  const frame = await shownFrame(page);
  await page.focus('.picture');
  await page.keyboard.press('PageDown');
  await page.waitForFunction(
      was => !document.querySelector('.frame-text').textContent.startsWith(`frame ${was} `), frame);
  const before = (await readout(page)).pixel;
  await page.keyboard.press('ArrowRight');
  assert.equal(numbers((await readout(page)).pixel)[0], numbers(before)[0] + 2);
  await close();
});

test('A footprint on the map opens its image', async () => {
  const {page, close} = await open('report/tartanair');
  await page.waitForSelector('svg.map polygon.footprint');
  const last = page.locator('svg.map polygon.footprint').last();
  const index = await last.getAttribute('data-index');
  await last.dispatchEvent('click');
  await page.waitForFunction(i => document.querySelector('#frames').dataset.shown === i, index);
  assert.equal(await page.locator('svg.map .footprint.selected').getAttribute('data-index'), index);
  await close();
});

const isBlank = bytes => bytes.length < 3000;  // a PNG of one colour is tiny
test('Cameras and points are drawn in three dimensions, and turn', async () => {
  const {page, close} = await open('report/tartanair');
  await page.locator('.space').scrollIntoViewIfNeeded();
  await page.waitForSelector('.space[data-points]');
  assert.ok(Number(await page.getAttribute('.space', 'data-points')) > 1000);
  await page.waitForTimeout(500);
  const first = await page.locator('.space').screenshot();
  assert.ok(!isBlank(first), `${first.length} bytes`);
  await page.focus('.space');
  for (let k = 0; k < 4; k++) await page.keyboard.press('ArrowLeft');
  await page.waitForTimeout(500);
  const turned = await page.locator('.space').screenshot();
  assert.ok(!isBlank(turned) && !turned.equals(first));
  await close();
});

test('Nothing that a dataset says becomes a part of the page', async () => {
  const {page, close} = await open('report/kitti');
  await page.waitForSelector('#frames[data-shown]');
  assert.equal(await page.evaluate(() => window.isBroken), undefined);
  assert.ok((await page.textContent('h1')).includes(truth.hostile_name));
  assert.ok((await page.title()).includes(truth.hostile_name));
  await close();
});

test('Named causes and certified bounds are told where a report has them', async () => {
  const copy = join(folder, 'more');
  cpSync(join(folder, 'report/kitti'), copy, {recursive: true});
  const file = join(copy, 'page/data.js');
  writeFileSync(
      file,
      readFileSync(file, 'utf8')
          .replace(
              '"causes":[]',
              '"causes":[{"words":"the clock is 0.1 s late","camera":"image_2","frame":2,"checks":["reprojection_time"]},{"share":0.75}],"bounds":{"depth_m":0.001}'));
  const {page, close} = await open('more');
  assert.match(
      await page.textContent('#part-causes'), /the clock is 0\.1 s late.*reprojection_time.*0\.75/);
  await page.click('#part-causes button.place');
  await page.waitForFunction(
      () => document.querySelector('.frame-text').textContent.startsWith('frame 2'));
  assert.match(await page.textContent('#part-bounds'), /depth m.*0\.001/);
  await close();
});

test('Each check has its plots, and the page its histograms, sizes and licences', async () => {
  const {page, close} = await open('report/kitti');
  await page.waitForSelector('#histograms svg.chart .bar');
  await page.click('#check-reprojection summary');
  await page.waitForSelector('#check-reprojection svg.chart polyline');
  await page.waitForSelector('#check-reprojection .figures img');
  assert.match(await page.textContent('#costs'), /depth.*\d/);
  assert.match(
      await page.textContent('.licences'), /three.*MIT[\s\S]*Permission is hereby granted/);
  assert.ok(await page.$eval('#each', each => each.querySelectorAll('details.check').length) > 20);
  await close();
});

for (const colorScheme of ['light', 'dark'])
  for (const width of [1400, 390])
    test(`Nothing is wider than ${width} px in a ${colorScheme} scheme`, async () => {
      const {page, close} =
          await open('report/tartanair', {viewport: {width, height: 900}, colorScheme});
      await page.waitForSelector('#frames[data-shown]');
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth) <= width);
      if (shots)
        await page.screenshot(
            {path: join(shots, `page-${colorScheme}-${width}.png`), fullPage: true});
      await close();
    });

test('The start page leads to each format, with and without scripts', async () => {
  const {page, close} = await open('report', {javaScriptEnabled: false});
  assert.match(await page.textContent('.verdict'), /wrong/);
  await page.click('.card:nth-of-type(2)');
  await page.waitForURL(/tartanair\/index\.html/);
  assert.match(await page.textContent('.verdict'), /Every bound holds/);
  assert.ok(
      await page.isVisible('noscript') ||
      await page.textContent('body').then(text => text.includes('need scripts')));
  await close();
});
