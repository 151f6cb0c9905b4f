// The page: what index.html says in words gets its map, images, cloud and plots.
import {enrichChecks, otherParts} from './checks';
import {buildCloud} from './cloud';
import {h, shown} from './dom';
import {buildMap} from './map';
import {Selection} from './selection';
import {buildCosts, buildHistograms} from './statistics';

import type {Check, Data} from './types';
import {buildViewer} from './viewer';

declare const LICENCES: {name: string; version: string; licence: string; text: string}[];
declare global {
  interface Window {
    terracastData: (data: Data) => void;
  }
}

function foot(data: Data): Node[] {
  return [
    h('p', {},
      `This page is ${
          shown(
              data.page_megabytes,
              3)} MB on disk and needs no network: index.html, report.json and the folder page.`),
    h('details', {class: 'licences'},
      h('summary', {},
        `It carries ${
            LICENCES.map(licence => `${licence.name} ${licence.version} (${licence.licence})`)
                .join(', ')}.`),
      ...LICENCES.map(
          licence => h('pre', {}, `${licence.name} ${licence.version}\n\n${licence.text}`))),
  ];
}

function start(data: Data) {
  const parts = document.getElementById('parts')!;
  const selection = new Selection(data);
  const hasImages = selection.images.length > 0;
  const open = (check: Check) => {
    selection.showCheck(check);
    document.getElementById('frames')!.scrollIntoView(
        {behavior: matchMedia('(prefers-reduced-motion: reduce)').matches ? 'auto' : 'smooth'});
  };
  const built: (Node|null)[] = [];
  for (const part of otherParts(selection)) {
    if (part.id !== 'part-causes') {
      built.push(part);
      continue;
    }
    // In place of the words that the page has without scripts.
    document.querySelector('ul.causes')?.remove();
    document.getElementById('checks')!.before(part);
  }
  if (hasImages) {
    built.push(buildViewer(selection));
    const pair = h('div', {class: 'pair'});
    if (data.sequences!.some(sequence => sequence.map)) pair.append(buildMap(selection));
    pair.append(buildCloud(selection));
    built.push(pair);
  }
  built.push(buildHistograms(data), buildCosts(data));
  parts.append(...built.filter(part => part !== null));
  enrichChecks(selection, open);
  const nav = document.querySelector('nav.jump')!;
  for (const section of document.querySelectorAll('main section[id]'))
    nav.append(h('a', {href: `#${section.id}`}, section.querySelector('h2')!.textContent));
  nav.removeAttribute('hidden');
  document.getElementById('foot')!.append(...foot(data));
  if (!hasImages) return;
  // The first look: what is wrong, else the first image of the camera of which most is known.
  const wrong = data.report.checks.find(check => !check.ok && selection.placeOf(check) >= 0);
  const most = Math.max(...selection.images.map(image => image.layers.length));
  if (wrong)
    selection.showCheck(wrong);
  else
    selection.show(selection.images.findIndex(image => image.layers.length === most));
}

window.terracastData = start;
