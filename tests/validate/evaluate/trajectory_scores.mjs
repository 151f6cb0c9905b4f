// Scores of a trajectory by another way than terracast's: quaternions throughout, alignment by Horn's 4 x 4
// matrix, segments by a walk along the path. Reads two TUM files of the same times, prints JSON.
// node trajectory_scores.mjs TRUTH RESULT SCALED(0 or 1) STRIDE LENGTH...
import {readFileSync} from 'node:fs';

const [truthFile, resultFile, scaled, stride, ...lengths] = process.argv.slice(2);
const rows = file => readFileSync(file, 'utf8').trim().split('\n').map(line => line.split(' ').map(Number));
const poses = file => rows(file).map(([time, x, y, z, qx, qy, qz, qw]) => ({time, t: [x, y, z], q: [qw, qx, qy, qz]}));
const times = (a, b) => [
  a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
  a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]];
const conjugate = q => [q[0], -q[1], -q[2], -q[3]];
const turned = (q, v) => times(times(q, [0, ...v]), conjugate(q)).slice(1);
const minus = (a, b) => a.map((value, k) => value - b[k]);
const dot = (a, b) => a.reduce((sum, value, k) => sum + value * b[k], 0);
const length = v => Math.sqrt(dot(v, v));
const rms = values => Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length);
const mean = values => values.reduce((sum, v) => sum + v, 0) / values.length;

const truth = poses(truthFile), result = poses(resultFile);

// Horn (1987): the rotation is the eigenvector of the greatest eigenvalue. Shifted to positive, squared often.
function align() {
  const centre = list => [0, 1, 2].map(k => mean(list.map(pose => pose.t[k])));
  const from = centre(result), to = centre(truth);
  const s = [0, 1, 2].map(i => [0, 1, 2].map(
    j => result.reduce((sum, pose, n) => sum + (pose.t[i] - from[i]) * (truth[n].t[j] - to[j]), 0)));
  const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
  let m = [[xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy]];
  const shift = Math.sqrt(m.flat().reduce((sum, v) => sum + v * v, 0));
  m = m.map((row, i) => row.map((v, j) => v + (i === j ? shift : 0)));
  for (let step = 0; step < 60; ++step) {
    m = m.map(row => [0, 1, 2, 3].map(j => row.reduce((sum, v, k) => sum + v * m[k][j], 0)));
    const size = Math.max(...m.flat().map(Math.abs));
    m = m.map(row => row.map(v => v / size));
  }
  const column = [0, 1, 2, 3].map(j => m.map(row => row[j])).reduce((a, b) => length(a) > length(b) ? a : b);
  const q = column.map(v => v / length(column));
  let scale = 1;
  if (scaled === '1') {
    let along = 0, own = 0;
    result.forEach((pose, n) => {
      const p = minus(pose.t, from);
      along += dot(minus(truth[n].t, to), turned(q, p));
      own += dot(p, p);
    });
    scale = along / own;
  }
  return {scale, laid: p => turned(q, minus(p, from)).map((v, k) => scale * v + to[k])};
}

const {scale, laid} = align();
// E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), of which the translation's length and the angle count.
function stepError(i, j) {
  const relative = (list, s) => ({
    q: times(conjugate(list[i].q), list[j].q),
    t: turned(conjugate(list[i].q), minus(list[j].t, list[i].t)).map(v => s * v)});
  const is = relative(truth, 1), says = relative(result, scale);
  const t = turned(conjugate(is.q), minus(says.t, is.t));
  const e = times(conjugate(is.q), says.q);
  return {m: length(t), deg: 2 * Math.atan2(length(e.slice(1)), Math.abs(e[0])) * 180 / Math.PI};
}

const steps = truth.slice(1).map((_, i) => stepError(i, i + 1));
const segments = [];
for (let i = 0; i < truth.length; i += Number(stride))
  for (const wanted of lengths.map(Number)) {
    let walked = 0, j = i;
    while (j + 1 < truth.length && walked <= wanted) walked += length(minus(truth[j + 1].t, truth[j++].t));
    if (walked <= wanted) continue;
    const error = stepError(i, j);
    segments.push({t: 100 * error.m / wanted, r: error.deg / wanted, seconds: truth[j].time - truth[i].time, error});
  }
console.log(JSON.stringify({
  ate: rms(truth.map((pose, i) => length(minus(laid(result[i].t), pose.t)))), scale,
  rpe: rms(steps.map(e => e.m)), rpe_deg: rms(steps.map(e => e.deg)),
  t_rel: mean(segments.map(s => s.t)), r_rel: mean(segments.map(s => s.r)),
  t_drift: mean(segments.map(s => s.error.m / s.seconds)), r_drift: mean(segments.map(s => s.error.deg / s.seconds)),
  segments: segments.length}));
