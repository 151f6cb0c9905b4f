// What page/data.js holds; written by validate/page_data.cpp.

export interface Check {
  name: string;
  value: number;
  bound: number;
  lower_bound: boolean;
  unit: string;
  ok: boolean;
  worst: string;
  skipped: boolean;
  unseen: boolean;
  summary: string;
  reason: string;
  detects: string;
  place?: {sequence: string; camera: string; frame: number; pixel?: [number, number]};
}
export interface Report {
  ok: boolean;
  unseen: string[];
  checks: Check[];
  [member: string]: unknown
}
export interface Plot {
  title: string;
  x_label: string;
  y_label: string;
  x: (number|null)[];
  y: (number|null)[];
}
export interface Picture {
  title: string;
  file: string;
  width: number;
  height: number
}
/** A rigid motion, its 3 x 4 matrix row by row. */
export type Pose = number[];
export interface Camera {
  name: string;
  width_px: number;
  height_px: number;
  fx_px?: number;
  fy_px?: number;
  cx_px?: number;
  cy_px?: number;
  track_frames: number[];
  track_poses: Pose[];
}
export interface Sequence {
  name: string;
  num_frames: number;
  rate_hz: number;
  utc_start: string;
  origin: {lat_deg: number; lon_deg: number; height_m: number};
  classes: Record<string, string>;
  track_stride: number;
  cameras: Camera[];
  stereo?: {left: number; right: number; baseline_m: number};
  map?: {
    west_m: number; east_m: number; south_m: number; north_m: number;
    file?: string; source: 'world' | 'depth' | 'none'
  };
  cloud?: {file: string; count: number; num_pixels: number};
}
export interface Image {
  file: string;
  sequence: number;
  camera: number;
  frame: number;
  width: number;
  height: number;
  step: number;
  has_color: boolean;
  layers: string[];
  residual_frame: number;
  median_depth_m: number;
  footprint: [number, number, number][];
  pose?: Pose;
}
export interface Octaves {
  edges: number[];
  counts: number[]
}
export interface Data {
  title: string;
  report: Report;
  page_megabytes: number;
  figures: Record < string, {
    plots: Plot[];
    pictures: Picture[]
  }
  > ;
  stages: {stage: string; wall_s: number; cpu_s: number; peak_bytes: number}[];
  format?: string;
  world?: string;
  sequences?: Sequence[];
  images?: Image[];
  num_images?: number;
  image_px?: number;
  far_depths?: number;
  statistics?: {
    depth_m: Octaves|null; flow_px: Octaves | null; slope_deg: number[] | null;
    classes: {name: string; count: number}[];
    overlap: {sequence: number; camera: number; frames: number[]; shares: number[]}[];
  };
  sizes?: {kind: string; files: number; bytes: number}[];
}
/** An array of numbers as validate/page_values.cpp packs it. */
export interface Packed {
  type: 'f32'|'i16'|'u8';
  count: number;
  data: string;
  scale?: number
}
