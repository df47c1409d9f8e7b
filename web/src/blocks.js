import * as THREE from 'three';

const perBlock = 16; // regions, whose numbers follow each other: most are side by side
const few = 64; // regions that are drawn each by itself
const rest = 400; // milliseconds: what has changed a moment ago will do so again
const atOnce = 4; // blocks that are made before a picture

/**
 * Regions of cells that are drawn together. Each by itself is a call of the graphics card's driver, and a thousand of them are all of a
 * picture's time; so what no longer changes is put together, as long as nothing has to be moved or counted by itself (exploded, sections, nets).
 * Regions stay as they are for who picks them.
 */
export class Blocks {
  constructor(stage, layer) {
    this.stage = stage;
    this.layer = layer;
    this.blocks = new Map();
  }

  /** A region has come, gone or got another look. */
  changed(item) {
    if (item.kind !== 'region' || typeof item.number !== 'number') return;
    const number = Math.floor(item.number / perBlock);
    if (!this.blocks.has(number)) this.blocks.set(number, { mesh: null, members: [], since: 0 });
    const block = this.blocks.get(number);
    this.divide(block);
    block.since = performance.now();
  }

  get isWanted() {
    const { regions, showsSurface, look, planes } = this.stage;
    return regions.size > few && !showsSurface && look.explode === 0 && planes.length === 0 && !look.mesh;
  }

  /** Before each picture. */
  update() {
    if (!this.isWanted) {
      for (const block of this.blocks.values()) this.divide(block);
      return;
    }
    const now = performance.now();
    const missing = [...this.blocks].filter(([, block]) => block.mesh === null && block.since >= 0);
    const ready = missing.filter(([, block]) => now - block.since >= rest);
    for (const [number, block] of ready.slice(0, atOnce)) this.unite(number, block);
    if (missing.length > 0 && !this.waits) {
      this.waits = true;
      setTimeout(() => { this.waits = false; this.stage.invalidate(); }, ready.length > atOnce ? 0 : rest);
    }
  }

  unite(number, block) {
    const { regions, scene } = this.stage;
    block.members = [];
    for (let i = number * perBlock; i < (number + 1) * perBlock; ++i) if (regions.get(i)?.solid?.visible) block.members.push(regions.get(i));
    if (block.members.length === 0) { block.since = -1; return; }
    block.mesh = new THREE.Mesh(united(block.members), this.stage.ofVertices);
    block.mesh.position.set(...block.members[0].message.origin);
    block.mesh.layers.set(this.layer);
    scene.add(block.mesh);
    for (const item of block.members) scene.remove(item.solid, item.net);
  }

  divide(block) {
    if (block.mesh === null) return;
    const { regions, scene } = this.stage;
    scene.remove(block.mesh);
    block.mesh.geometry.dispose();
    block.mesh = null;
    for (const item of block.members) if (regions.get(item.number) === item) scene.add(item.solid, item.net);
    block.members = [];
  }
}

/** About the origin of the first one. */
function united(members) {
  const { origin } = members[0].message;
  const count = (of) => members.reduce((sum, item) => sum + of(item), 0);
  const points = count((item) => item.message.arrays.positions.length);
  const positions = new Float32Array(points), colours = new Uint8Array(points / 3 * 4);
  const indices = new Uint32Array(count((item) => item.solid.geometry.index.count));
  let first = 0, at = 0;
  for (const { message, solid } of members) {
    const own = message.arrays.positions;
    for (let i = 0; i < own.length; ++i) positions[3 * first + i] = message.origin[i % 3] - origin[i % 3] + message.step * own[i];
    colours.set(solid.geometry.getAttribute('color').array, 4 * first);
    for (const index of solid.geometry.index.array) indices[at++] = first + index;
    first += own.length / 3;
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute('color', new THREE.BufferAttribute(colours, 4, true));
  geometry.setIndex(new THREE.BufferAttribute(indices, 1));
  return geometry;
}
