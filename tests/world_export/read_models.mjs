// Reads models with three.js' loaders and tells what they hold, as JSON.
//   node read_models.mjs PACKAGES QUERIES.json
// QUERIES.json: {"pictures": folder, "files": [{"file": path, "places": [[east, north], …]}, …]}. For each file: its
// meshes with names, triangles and textures; the box of all, east, north, up; and what lies highest at each place.
// Pictures are written into the folder as the file holds them, for somebody else to decode.
import {readFileSync, writeFileSync} from 'node:fs';
import {basename, dirname, join} from 'node:path';
import {pathToFileURL} from 'node:url';

const [packages, queriesFile] = process.argv.slice(2);
const three = name => import(pathToFileURL(join(packages, 'three', name)));
const THREE = await three('build/three.module.js');
const {GLTFLoader} = await three('examples/jsm/loaders/GLTFLoader.js');
const {OBJLoader} = await three('examples/jsm/loaders/OBJLoader.js');
const {MTLLoader} = await three('examples/jsm/loaders/MTLLoader.js');
const queries = JSON.parse(readFileSync(queriesFile, 'utf8'));

// What a browser has: here a picture is its bytes.
globalThis.self = globalThis;
globalThis.createImageBitmap = async blob => ({bytes: Buffer.from(await blob.arrayBuffer()), close() {}});

let numPictures = 0;
function pictureOf(texture) {
  if (!texture?.image?.bytes) return null;
  texture.image.file ??= join(queries.pictures, `picture_${numPictures++}.png`);
  writeFileSync(texture.image.file, texture.image.bytes);
  return texture.image.file;
}

async function load(file) {
  if (file.endsWith('.glb')) {
    const bytes = readFileSync(file);
    const whole = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
    return (await new GLTFLoader().parseAsync(whole, '')).scene;
  }
  const text = readFileSync(file, 'utf8');
  const folder = dirname(file);
  const manager = new THREE.LoadingManager();
  manager.addHandler(/\.png$/, {
    load(url) {
      const texture = new THREE.Texture({bytes: readFileSync(join(folder, basename(url)))});
      return texture;
    }
  });
  const library = /^mtllib (.*)$/m.exec(text)[1].trim();
  const materials =
      new MTLLoader(manager).parse(readFileSync(join(folder, library), 'utf8'), '');
  materials.preload();
  return new OBJLoader().setMaterials(materials).parse(text);
}

const enu = (v, isUpY) => isUpY ? [v.x, -v.z, v.y] : [v.x, v.y, v.z];

function look(root, file, places) {
  const isUpY = file.endsWith('.glb');
  root.updateMatrixWorld(true);
  const meshes = [];
  root.traverse(node => {
    if (!node.isMesh) return;
    const count = node.geometry.index?.count ?? node.geometry.attributes.position.count;
    const materials = [node.material].flat();
    meshes.push({
      name: node.name,
      triangles: count / 3,
      colors: materials.map(material => material.color.toArray()),
      pictures: materials.map(material => pictureOf(material.map))
    });
  });
  const box = new THREE.Box3().setFromObject(root, true);
  const seen = places.map(([east, north]) => {
    const ray = isUpY ? new THREE.Raycaster(new THREE.Vector3(east, 1e5, -north), new THREE.Vector3(0, -1, 0))
                      : new THREE.Raycaster(new THREE.Vector3(east, north, 1e5), new THREE.Vector3(0, 0, -1));
    const [hit] = ray.intersectObject(root, true);
    if (!hit) return null;
    const material = [hit.object.material].flat()[hit.face.materialIndex ?? 0];
    // From the upper left corner of the picture; glTF counts v so already.
    const map = material.map;
    const v = hit.uv && map ? (map.flipY ? 1 - hit.uv.y : hit.uv.y) : 0;
    return {
      mesh: hit.object.name,
      up: enu(hit.point, isUpY)[2],
      picture: pictureOf(map),
      color: material.color.toArray(),
      repeats: map ? map.wrapS === THREE.RepeatWrapping : false,
      uv: hit.uv ? [hit.uv.x, v] : [0, 0]
    };
  });
  const corners = [enu(box.min, isUpY), enu(box.max, isUpY)];
  return {
    meshes,
    lowest: corners[0].map((value, k) => Math.min(value, corners[1][k])),
    highest: corners[0].map((value, k) => Math.max(value, corners[1][k])),
    seen
  };
}

const told = [];
for (const {file, places} of queries.files) told.push(look(await load(file), file, places));
console.log(JSON.stringify(told));
