// Pixels, points and normals, as docs/frames.md has them: camera x right, y down, z forward; the
// centre of the top-left pixel is (0.5, 0.5); the local frame is east, north, up.
import type {Camera, Image, Pose} from './types';

export type Vector = [number, number, number];

export const toLocal =
    (pose: Pose, p: Vector): Vector => [0, 1, 2].map(
                                           r => pose[4 * r] * p[0] + pose[4 * r + 1] * p[1] +
                                               pose[4 * r + 2] * p[2] + pose[4 * r + 3]) as Vector;
export const turned =
    (pose: Pose, d: Vector): Vector => [0, 1, 2].map(
                                           r => pose[4 * r] * d[0] + pose[4 * r + 1] * d[1] +
                                               pose[4 * r + 2] * d[2]) as Vector;
export const centreOf = (pose: Pose): Vector => [pose[3], pose[7], pose[11]];

export const isUsable = (camera: Camera): camera is Required<Camera> => camera.fx_px !== undefined;

/** The point of the ray through a pixel's place at depth 1, camera frame. */
export const rayOf = (camera: Required<Camera>, x: number, y: number):
    Vector => [(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1];

/** The pixel of the whole image whose value a grid's place holds. */
export const pixelOf = (image: Image, grid: number) =>
    image.step * grid + Math.floor(image.step / 2);

/** The point of a grid's place, camera frame; nothing without depth. */
export function pointAt(
    camera: Required<Camera>, image: Image, depth: ArrayLike<number>, i: number, j: number): Vector|
    null {
  if (i < 0 || j < 0 || i >= image.width || j >= image.height) return null;
  const depth_m = depth[j * image.width + i];
  if (!Number.isFinite(depth_m)) return null;
  const ray = rayOf(camera, pixelOf(image, i) + 0.5, pixelOf(image, j) + 0.5);
  return [ray[0] * depth_m, ray[1] * depth_m, depth_m];
}

/**
 * The surface's normal by the gradient of depth between the neighbours in the grid, local frame,
 * towards the camera; nothing where a neighbour has none.
 */
export function normalAt(
    camera: Required<Camera>, image: Image, depth: ArrayLike<number>, i: number, j: number): Vector|
    null {
  if (!image.pose) return null;
  const left = pointAt(camera, image, depth, i - 1, j),
        right = pointAt(camera, image, depth, i + 1, j);
  const above = pointAt(camera, image, depth, i, j - 1),
        below = pointAt(camera, image, depth, i, j + 1);
  if (!left || !right || !above || !below) return null;
  const across = right.map((v, k) => v - left[k]), down = below.map((v, k) => v - above[k]);
  // Down the image times across it points to the camera.
  const normal: Vector = [
    down[1] * across[2] - down[2] * across[1], down[2] * across[0] - down[0] * across[2],
    down[0] * across[1] - down[1] * across[0]
  ];
  const length = Math.hypot(...normal);
  return length > 0 ? turned(image.pose, normal.map(v => v / length) as Vector) : null;
}
