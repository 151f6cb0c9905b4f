// Values of images and clouds, which lie in scripts of their own: a page that is opened as a file
// may load scripts, and nothing else that it could read numbers from.
import type {Image, Packed} from './types';
import {unpacked, type Values} from './values';

export interface Layers {
  [name: string]: Values
}
export interface Cloud {
  origin: number[];
  count: number;
  positions: Float32Array;
  colors: Uint8Array
}

interface ImageScript {
  index: number;
  layers: Record<string, Packed>
}
interface CloudScript {
  sequence: number;
  origin: number[];
  count: number;
  positions: Packed;
  colors: Packed;
}
declare global {
  interface Window {
    terracastImage: (script: ImageScript) => void;
    terracastCloud: (script: CloudScript) => void;
  }
}

const arrivedImages = new Map<number, ImageScript>();
const arrivedClouds = new Map<number, CloudScript>();
window.terracastImage = script => arrivedImages.set(script.index, script);
window.terracastCloud = script => arrivedClouds.set(script.sequence, script);

function runScript(path: string): Promise<void> {
  return new Promise((resolve, reject) => {
    const script = document.createElement('script');
    script.src = `page/${path}`;
    script.onload = () => (script.remove(), resolve());
    script.onerror = () => (script.remove(), reject(new Error(`page/${path} cannot be read`)));
    document.head.append(script);
  });
}

/** The images last looked at stay in memory. */
const kept = new Map<number, Promise<Layers>>();
const kMostKept = 12;

async function readImage(index: number, image: Image): Promise<Layers> {
  await runScript(`${image.file}.js`);
  const script = arrivedImages.get(index);
  arrivedImages.delete(index);
  if (!script) throw new Error(`page/${image.file}.js holds another image`);
  const layers: Layers = {};
  for (const [name, packed] of Object.entries(script.layers)) layers[name] = await unpacked(packed);
  return layers;
}

export function layersOf(index: number, image: Image): Promise<Layers> {
  const found = kept.get(index) ?? readImage(index, image);
  kept.delete(index);
  kept.set(index, found);
  for (const oldest of kept.keys()) {
    if (kept.size <= kMostKept) break;
    kept.delete(oldest);
  }
  return found;
}

export async function cloudOf(sequence: number, file: string): Promise<Cloud> {
  await runScript(file);
  const script = arrivedClouds.get(sequence);
  arrivedClouds.delete(sequence);
  if (!script) throw new Error(`page/${file} holds another cloud`);
  return {
    origin: script.origin,
    count: script.count,
    positions: await unpacked(script.positions) as Float32Array,
    colors: await unpacked(script.colors) as Uint8Array,
  };
}
