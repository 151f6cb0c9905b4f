// Which image the parts of the page look at; each part may change it, all follow.
import type {Check, Data, Image} from './types';

export interface Selected {
  index: number;                 ///< of data.images
  pixel: [number, number]|null;  ///< of the whole image
  check: Check|null;             ///< whose worst place it is
}
type Listener = (selected: Selected) => void;

export class Selection {
  private listeners: Listener[] = [];
  readonly images: Image[];
  current: Selected = {index: -1, pixel: null, check: null};

  constructor(readonly data: Data) {
    this.images = data.images ?? [];
  }

  get image(): Image {
    return this.images[this.current.index];
  }

  follow(listener: Listener) {
    this.listeners.push(listener);
  }

  show(index: number, pixel: [number, number]|null = null, check: Check|null = null) {
    if (!this.images[index]) return;
    this.current = {index, pixel, check};
    for (const listener of this.listeners) listener(this.current);
  }

  /** The images of a camera, in the order of their frames. */
  ofCamera(sequence: number, camera: number): number[] {
    const found: number[] = [];
    this.images.forEach((image, i) => {
      if (image.sequence === sequence && image.camera === camera) found.push(i);
    });
    return found;
  }

  /** The camera's image whose frame is nearest. */
  nearest(sequence: number, camera: number, frame: number): number {
    let best = -1;
    for (const i of this.ofCamera(sequence, camera))
      if (best < 0 ||
          Math.abs(this.images[i].frame - frame) < Math.abs(this.images[best].frame - frame))
        best = i;
    return best;
  }

  /** The image that a check's worst place is in; -1: the check names none. */
  placeOf(check: Check): number {
    const place = check.place;
    if (!place) return -1;
    const sequences = this.data.sequences ?? [];
    return this.images.findIndex(image => {
      const sequence = sequences[image.sequence];
      return sequence.name === place.sequence && image.frame === place.frame &&
          sequence.cameras[image.camera].name === place.camera;
    });
  }

  showCheck(check: Check) {
    this.show(this.placeOf(check), check.place?.pixel ?? null, check);
  }
}
