// The cameras and the ground in three dimensions, local frame: x east, y north, z up.
import {BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineLoop, LineSegments, PerspectiveCamera, Points, PointsMaterial, Scene, Vector3, WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

import {css, kindColor} from './colors';
import {darkness, everyText, h, shown} from './dom';

import {centreOf, isUsable, rayOf, toLocal, type Vector} from './geometry';
import {cloudOf} from './load';
import type {Selection} from './selection';
import type {Camera, Pose} from './types';

export function buildCloud(selection: Selection): HTMLElement {
  const sequences = selection.data.sequences!;
  const box = h('div', {
    class: 'space',
    tabindex: 0,
    role: 'img',
    'aria-label': 'cameras and points in three dimensions; arrow keys turn it, plus and minus zoom'
  });
  const note = h('p', {class: 'note'});
  const section = h('section', {id: 'space'}, h('h2', {}, 'Cameras and points in 3-D'), note);
  let renderer: WebGLRenderer;
  try {
    renderer = new WebGLRenderer({antialias: true});
  } catch {
    note.textContent = 'This browser shows no WebGL, which this part needs.';
    return section;
  }
  box.append(renderer.domElement);
  const scene = new Scene(), eye = new PerspectiveCamera(45, 1, 1, 1e6);
  eye.up.set(0, 0, 1);
  const controls = new OrbitControls(eye, renderer.domElement);
  controls.maxPolarAngle = 0.95 * Math.PI;
  // A wheel alone scrolls the page.
  renderer.domElement.addEventListener('wheel', event => {
    if (!event.ctrlKey && !event.metaKey) event.stopImmediatePropagation();
  }, {capture: true});
  let pending = false;
  const render = () => {
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      renderer.render(scene, eye);
    });
  };
  controls.addEventListener('change', render);

  let origin: Vector = [0, 0, 0], size_m = 1, drawn = -1, radius_m = 100, target = new Vector3();
  const placed = (p: Vector) => new Vector3(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]);

  /** The edges of a camera's pyramid, as pairs of points. */
  function pyramid(camera: Required<Camera>, pose: Pose, depth_m: number): Vector3[] {
    const at = (x: number, y: number) =>
        placed(toLocal(pose, rayOf(camera, x, y).map(v => v * depth_m) as Vector));
    const tip = placed(centreOf(pose)), w = camera.width_px, t = camera.height_px;
    const corners = [at(0, 0), at(w, 0), at(w, t), at(0, t)];
    const edges = corners.flatMap((corner, k) => [tip, corner, corner, corners[(k + 1) % 4]]);
    // A roof shows which side of the image is up.
    const roof =
        placed(toLocal(pose, rayOf(camera, w / 2, -0.18 * t).map(v => v * depth_m) as Vector));
    return [...edges, corners[0], roof, roof, corners[1]];
  }
  const segments = (points: Vector3[], color: Color, opacity: number) => new LineSegments(
      new BufferGeometry().setFromPoints(points),
      new LineBasicMaterial({color, transparent: opacity < 1, opacity}));

  let chosen: (LineSegments|LineLoop)[] = [];
  function markSelected() {
    for (const part of chosen) {
      scene.remove(part);
      part.geometry.dispose();
    }
    chosen = [];
    const image = selection.image, camera = sequences[image.sequence].cameras[image.camera];
    if (image.pose && isUsable(camera)) {
      const color = new Color(darkness.matches ? '#ffd23f' : '#c2185b');
      chosen.push(segments(pyramid(camera, image.pose, 2.2 * size_m), color, 1));
      if (image.footprint.length > 2)
        chosen.push(new LineLoop(
            new BufferGeometry().setFromPoints(image.footprint.map(placed)),
            new LineBasicMaterial({color})));
      scene.add(...chosen);
    }
    render();
  }

  async function show(number: number) {
    const sequence = sequences[number];
    scene.clear();
    chosen = [];
    origin = [0, 0, 0];
    const cloud =
        sequence.cloud ? await cloudOf(number, sequence.cloud.file).catch(() => null) : null;
    if (number !== drawn) return;
    const tracks = sequence.cameras.flatMap(camera => camera.track_poses.map(centreOf));
    if (cloud)
      origin = cloud.origin as Vector;
    else if (tracks.length)
      origin = tracks[tracks.length >> 1];
    // What the first view shows: the cameras, and where the middles of their images meet the ground.
    const around = [
      ...tracks.map(placed),
      ...selection.images
          .filter(image => image.sequence === number && image.pose && image.median_depth_m > 0)
          .map(image => placed(toLocal(image.pose!, [0, 0, image.median_depth_m])))
    ];
    target = around.reduce((sum, p) => sum.add(p), new Vector3())
                 .divideScalar(Math.max(around.length, 1));
    const distances = around.map(p => p.distanceTo(target)).sort((a, b) => a - b);
    radius_m = Math.max(1.15 * (distances[distances.length - 1] ?? 0), 1);
    size_m = 0.06 * radius_m;
    if (cloud) {
      const positions = new Float32Array(3 * cloud.count), colors = new Uint8Array(3 * cloud.count);
      for (let i = 0; i < cloud.count; i++)
        for (let k = 0; k < 3; k++) {
          positions[3 * i + k] = cloud.positions[k * cloud.count + i];
          colors[3 * i + k] = cloud.colors[k * cloud.count + i];
        }
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(positions, 3));
      geometry.setAttribute('color', new BufferAttribute(colors, 3, true));
      const points = new Points(
          geometry, new PointsMaterial({size: 2.2, sizeAttenuation: false, vertexColors: true}));
      // Colours are shown as the images have them.
      points.material.onBeforeCompile = shader => {
        shader.fragmentShader = shader.fragmentShader.replace('#include <colorspace_fragment>', '');
      };
      scene.add(points);
    }
    sequence.cameras.forEach((camera, c) => {
      if (!isUsable(camera)) return;
      const stride = Math.max(1, Math.ceil(camera.track_poses.length / 300));
      scene.add(segments(
          camera.track_poses.filter((_, k) => k % stride === 0)
              .flatMap(pose => pyramid(camera, pose, size_m)),
          new Color(css(kindColor(c)).replaceAll(' ', ',')), 0.75));
    });
    note.textContent = `${
        cloud ? `${shown(cloud.count, 6)} of ${
                    shown(sequence.cloud!.num_pixels, 9)} pixels with depth, in their colours, ` :
                'No depth; '}and the pyramid of each camera in ${
        sequence.track_stride > 1 ?
            `${everyText(sequence.track_stride)} frame` :
            'every frame'}. Drag to turn, with the right button to move; hold Ctrl and turn the wheel to zoom. Click at a camera to open its image.`;
    look(-0.5, -0.75, 0.62);
    markSelected();
    box.dataset.points = String(cloud?.count ?? 0);
  }

  function look(x: number, y: number, z: number) {
    const away = new Vector3(x, y, z).normalize().multiplyScalar(2.1 * radius_m);
    eye.position.copy(target).add(away);
    eye.near = radius_m / 500;
    eye.far = radius_m * 400;
    eye.updateProjectionMatrix();
    controls.target.copy(target);
    controls.update();
    render();
  }
  function asCamera() {
    const image = selection.image;
    if (!image.pose) return;
    eye.position.copy(placed(centreOf(image.pose)));
    eye.near = radius_m / 2000;
    eye.updateProjectionMatrix();
    controls.target.copy(
        placed(toLocal(image.pose, [0, 0, Math.max(image.median_depth_m, 0.1 * radius_m)])));
    controls.update();
    render();
  }

  function turn(by: number, tilt: number, nearer = 1) {
    const arm = eye.position.clone().sub(controls.target);
    const length = arm.length() * nearer, height = Math.asin(arm.z / arm.length()) + tilt,
          angle = Math.atan2(arm.y, arm.x) + by;
    const level = Math.min(Math.max(height, -1.4), 1.54);
    eye.position
        .set(Math.cos(angle) * Math.cos(level), Math.sin(angle) * Math.cos(level), Math.sin(level))
        .multiplyScalar(length)
        .add(controls.target);
    controls.update();
    render();
  }
  box.addEventListener('keydown', event => {
    const act = {
      ArrowLeft: () => turn(-0.15, 0),
      ArrowRight: () => turn(0.15, 0),
      ArrowUp: () => turn(0, 0.1),
      ArrowDown: () => turn(0, -0.1),
      '+': () => turn(0, 0, 0.8),
      '=': () => turn(0, 0, 0.8),
      '-': () => turn(0, 0, 1.25)
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });

  let down: [number, number]|null = null;
  renderer.domElement.addEventListener('pointerdown', event => {
    down = [event.clientX, event.clientY];
  });
  renderer.domElement.addEventListener('pointerup', event => {
    if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
    const area = renderer.domElement.getBoundingClientRect();
    let best = -1, least = 16;  // screen pixels
    selection.images.forEach((image, index) => {
      if (image.sequence !== drawn || !image.pose) return;
      const at = placed(centreOf(image.pose)).project(eye);
      if (at.z > 1) return;
      const distance = Math.hypot(
          (at.x + 1) / 2 * area.width - (event.clientX - area.left),
          (1 - at.y) / 2 * area.height - (event.clientY - area.top));
      if (distance < least) [best, least] = [index, distance];
    });
    if (best >= 0) selection.show(best);
  });

  const ground = () => {
    scene.background = new Color(
        getComputedStyle(document.documentElement).getPropertyValue('--sunken').trim() || '#eee');
  };
  ground();
  darkness.addEventListener('change', () => {
    ground();
    if (selection.image) markSelected();
  });
  new ResizeObserver(() => {
    const {width, height} = box.getBoundingClientRect();
    if (!width || !height) return;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    eye.aspect = width / height;
    eye.updateProjectionMatrix();
    render();
  }).observe(box);

  // Nothing is loaded or drawn before somebody looks.
  let isSeen = false;
  const follow = () => {
    const number = selection.image.sequence;
    if (!isSeen) return;
    if (number === drawn) return markSelected();
    drawn = number;
    void show(number);
  };
  new IntersectionObserver((entries, observer) => {
    if (!entries.some(entry => entry.isIntersecting) || !selection.image) return;
    isSeen = true;
    observer.disconnect();
    follow();
  }, {rootMargin: '200px'}).observe(box);
  selection.follow(follow);

  const button = (text: string, click: () => void) => h('button', {type: 'button', click}, text);
  section.append(
      h('div', {class: 'framed'}, box,
        h('div', {class: 'bar'}, button('from the side', () => look(-0.5, -0.75, 0.62)),
          button('from above', () => look(0, -0.02, 1)), button('as the camera', asCamera))));
  return section;
}
