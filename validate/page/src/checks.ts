// The checks: from each one's row to its worst place; plots, pictures, and what else a report says.
import {linePlot} from './charts';
import {h, shown} from './dom';
import type {Selection} from './selection';
import type {Check} from './types';

function placeText(check: Check): string {
  const place = check.place!;
  return `${place.camera}, frame ${place.frame}${
      place.pixel ? `, pixel (${place.pixel.join(', ')})` : ''}`;
}

/** Puts buttons to worst places into the table and the details that the page already has. */
export function enrichChecks(selection: Selection, open: (check: Check) => void) {
  const {report, figures} = selection.data;
  const rows = new Map([...document.querySelectorAll<HTMLElement>('#checks tr[data-check]')].map(
      row => [row.dataset.check, row]));
  for (const check of report.checks) {
    const details = document.getElementById(`check-${check.name}`);
    const hasPlace = check.place && selection.placeOf(check) >= 0;
    const button = () =>
        h('button', {
          type: 'button',
          class: 'place',
          'data-check': check.name,
          title: `open the worst place of ${check.name}`,
          click: () => open(check)
        },
          placeText(check));
    if (hasPlace) {
      const cell = rows.get(check.name)?.querySelector('.worst');
      if (cell) {
        cell.setAttribute('title', check.worst);
        cell.replaceChildren(button());
      }
      details?.querySelector('.body')?.prepend(
          h('p', {class: 'open-worst'}, 'Worst place: ', button()));
    }
    const place = details?.querySelector('.figures');
    const own = figures[check.name];
    if (!place || !own) continue;
    // Drawn when they are looked at.
    const fill = () => {
      if (place.childElementCount) return;
      place.append(
          ...own.plots.map(linePlot).filter(plot => plot !== null),
          ...own.pictures.map(
              picture =>
                  h('figure', {}, h('img', {
                      src: `page/${picture.file}`,
                      width: picture.width,
                      height: picture.height,
                      alt: picture.title,
                      loading: 'lazy'
                    }),
                    h('figcaption', {class: 'soft'}, picture.title))));
    };
    if ((details as HTMLDetailsElement).open) fill();
    details!.addEventListener('toggle', fill);
  }
  const openNamed = () => {
    const named = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (named instanceof HTMLDetailsElement) {
      named.open = true;
      named.scrollIntoView();
    }
  };
  window.addEventListener('hashchange', openNamed);
  openNamed();
}

const words = (name: string) => name.replaceAll('_', ' ');

/** Any JSON as tables and lists. */
function told(value: unknown): Node {
  if (Array.isArray(value)) {
    if (value.length === 0) return document.createTextNode('none');
    if (value.every(item => item !== null && typeof item === 'object' && !Array.isArray(item))) {
      const columns = [...new Set(value.flatMap(item => Object.keys(item as object)))];
      return h(
          'div', {class: 'wide'},
          h('table', {},
            h('thead', {},
              h('tr', {}, ...columns.map(column => h('th', {scope: 'col'}, words(column))))),
            h('tbody', {},
              ...value.map(
                  item => h(
                      'tr', {},
                      ...columns.map(
                          column =>
                              h('td', {
                                class: typeof (item as any)[column] === 'number' ? 'num' : undefined
                              },
                                told((item as any)[column]))))))));
    }
    if (value.every(item => item === null || typeof item !== 'object'))
      return document.createTextNode(value.map(item => told(item).textContent).join(', '));
    return h('ul', {}, ...value.map(item => h('li', {}, told(item))));
  }
  if (value !== null && typeof value === 'object')
    return h(
        'dl', {},
        ...Object.entries(value).flatMap(
            ([name, item]) => [h('dt', {}, words(name)), h('dd', {}, told(item))]));
  if (typeof value === 'number') return document.createTextNode(shown(value, 6));
  if (typeof value === 'boolean') return document.createTextNode(value ? 'yes' : 'no');
  return document.createTextNode(value === null || value === undefined ? '' : String(value));
}

/** A cause of failed checks, as a report names it; any of it may be missing. */
interface Cause {
  words?: string;
  sequence?: string;
  camera?: string;
  frame?: number;
  checks?: string[];
  [member: string]: unknown
}

function causesPart(selection: Selection, causes: Cause[]): HTMLElement {
  const sequences = selection.data.sequences ?? [];
  return h(
      'section', {id: 'part-causes'}, h('h2', {}, 'Causes'),
      h('p', {class: 'note'}, 'What explains the failed checks.'),
      h('ol', {class: 'cause-list'}, ...causes.map(cause => {
        if (typeof cause.words !== 'string') return h('li', {}, told(cause));
        const index = selection.images.findIndex(
            image => image.frame === cause.frame &&
                sequences[image.sequence].cameras[image.camera].name === cause.camera &&
                (!cause.sequence || sequences[image.sequence].name === cause.sequence));
        return h(
            'li', {}, cause.words,
            index >= 0 &&
                h('button', {
                  type: 'button',
                  class: 'place',
                  click: () => {
                    selection.show(index);
                    document.getElementById('frames')!.scrollIntoView();
                  }
                },
                  ` ${cause.camera}, frame ${cause.frame}`),
            Array.isArray(cause.checks) && cause.checks.length > 0 &&
                h('div', {class: 'soft'}, 'seen by ',
                  ...cause.checks.flatMap(
                      (name,
                       i) => [i ? ', ' : '', h('a', {href: `#check-${name}`}, String(name))])));
      })));
}

const kTitles: Record<string, string> = {
  bounds: 'Certified bounds'
};

/** What a report says beside its checks, each member as a part of its own. */
export function otherParts(selection: Selection): HTMLElement[] {
  return Object.entries(selection.data.report)
      .filter(
          ([name, value]) => !['ok', 'unseen', 'checks'].includes(name) &&
              !(Array.isArray(value) && value.length === 0))
      .map(
          ([name, value]) => name === 'causes' && Array.isArray(value) ?
              causesPart(selection, value as Cause[]) :
              h('section', {id: `part-${name}`}, h('h2', {}, kTitles[name] ?? words(name)),
                told(value)));
}
