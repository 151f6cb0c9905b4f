// Arrays of numbers out of the text that scripts carry; the other end is validate/page_values.cpp.
import type {Packed} from './types';

export type Values = Float32Array|Int16Array|Uint8Array;

async function inflated(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Byte planes of differences, put together again: exact to the bit. */
export function fromPlanes(planes: Uint8Array, type: Packed['type'], count: number): Values {
  if (type === 'u8') {
    const values = new Uint8Array(count);
    for (let i = 0, value = 0; i < count; i++) values[i] = value = (value + planes[i]) & 255;
    return values;
  }
  if (type === 'i16') {
    const bits = new Uint16Array(count);
    for (let i = 0, value = 0; i < count; i++)
      bits[i] = value = (value + (planes[i] | planes[count + i] << 8)) & 65535;
    return new Int16Array(bits.buffer);
  }
  const bits = new Uint32Array(count);
  for (let i = 0, value = 0; i < count; i++) {
    const difference = planes[i] | planes[count + i] << 8 | planes[2 * count + i] << 16 |
        planes[3 * count + i] << 24;
    bits[i] = value = (value + difference) >>> 0;
  }
  return new Float32Array(bits.buffer);
}

export async function unpacked(packed: Packed): Promise<Values> {
  const text = atob(packed.data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return fromPlanes(await inflated(bytes), packed.type, packed.count);
}
