// What is seen: camera, lights, cells, surface, sections. Draws only when something has changed.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { Blocks } from './blocks.js';
import * as colours from './colours.js';

// Where a triangle is seen from its edge, the middle of a pixel may be far beside it: what is cut off must be asked
// where the triangle is, or sections are filled where nothing is.
for (const chunk of ['clipping_planes_pars_vertex', 'clipping_planes_pars_fragment'])
  THREE.ShaderChunk[chunk] = THREE.ShaderChunk[chunk].replace('varying vec3 vClipPosition', 'centroid varying vec3 vClipPosition');

const nobody = 0xffff; // a vertex of no part, or without a colour
const solids = 1; // the layer of what sections are filled in
const noPart = -1;

/** Numbers of parts as they are in a header. */
const partOf = (number) => (number === nobody ? noPart : number);

export class Stage {
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, stencil: true, alpha: true, powerPreference: 'high-performance' });
    this.renderer.autoClear = false;
    this.renderer.localClippingEnabled = true;
    this.scene = new THREE.Scene();
    this.perspective = new THREE.PerspectiveCamera(30, 1, 0.1, 1000);
    this.parallel = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 1000);
    for (const camera of [this.perspective, this.parallel]) { camera.up.set(0, 0, 1); camera.layers.enable(solids); }
    this.camera = this.perspective;
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { zoomToCursor: true, rotateSpeed: 0.9, zoomSpeed: 1.2, screenSpacePanning: true });
    this.controls.addEventListener('change', () => { this.invalidate(); this.onChange(); });

    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa6b4, 1.5));
    this.lamp = new THREE.DirectionalLight(0xffffff, 2.6);
    this.side = new THREE.DirectionalLight(0xdfe9ff, 0.7);
    for (const light of [this.lamp, this.side]) { this.scene.add(light); this.scene.add(light.target); }

    this.planes = [];
    this.sections = [null, null, null]; // what planes cut open, by axis, as bsp2 has told it
    this.looks = 0; // how often the looks of things have changed
    this.clips = ['x', 'y', 'z'].map((axis) => ({ axis, on: false, at: 0.5, flip: false }));
    this.regions = new Map(); // number of the region: what is drawn of it
    this.pieces = new Map();
    this.blocks = new Blocks(this, solids);
    this.coming = null; // of a run whose picture is not complete, while that of another is shown
    this.run = 0;
    this.model = { parts: [], colours: [], lower: [], upper: [], dimension: 3 };
    this.hidden = new Set();
    this.look = { shade: 'colour', what: 'auto', wire: true, mesh: false, fuzzy: true, explode: 0, parallel: false };
    this.hasSurface = false;
    this.isPlaced = false;
    this.box = new THREE.Box3();
    this.selected = new THREE.Group();
    this.scene.add(this.selected);
    this.stats = { bytes: 0, triangles: 0, firstPicture: 0, script: 0, frames: 0, longest: 0, messages: 0 };
    this.makeMaterials();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    const frame = () => { requestAnimationFrame(frame); if (this.isStale) this.draw(); };
    requestAnimationFrame(frame);
  }

  makeMaterials() {
    const clipped = { clippingPlanes: this.planes };
    const offset = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    this.ofVertices = new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true, ...offset, ...clipped });
    this.ofColour = new Map();
    this.undecided = new THREE.MeshLambertMaterial({ color: colours.hex(colours.fuzzy), flatShading: true, transparent: true, opacity: 0.17, depthWrite: false, ...clipped });
    this.lines = new THREE.LineBasicMaterial({ color: 0x1b232b, transparent: true, opacity: 0.75, ...clipped });
    this.net = new THREE.MeshBasicMaterial({ color: 0x1b232b, wireframe: true, transparent: true, opacity: 0.28, ...clipped });
    const stencil = { colorWrite: false, depthWrite: false, depthTest: false, stencilWrite: true, stencilFunc: THREE.AlwaysStencilFunc };
    const counting = (side, op) => new THREE.MeshBasicMaterial({ ...stencil, side, stencilFail: op, stencilZFail: op, stencilZPass: op, clippingPlanes: [] });
    this.backs = counting(THREE.BackSide, THREE.IncrementWrapStencilOp);
    this.fronts = counting(THREE.FrontSide, THREE.DecrementWrapStencilOp);
    this.marked = new THREE.MeshBasicMaterial({ color: 0xff8a1f, transparent: true, opacity: 0.45, depthTest: true, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1, side: THREE.DoubleSide, ...clipped });
    this.capScene = new THREE.Scene();
    const hatch = new THREE.CanvasTexture(hatching());
    hatch.wrapS = hatch.wrapT = THREE.RepeatWrapping;
    hatch.colorSpace = THREE.SRGBColorSpace;
    hatch.anisotropy = 4;
    this.cap = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), new THREE.MeshBasicMaterial({
      map: hatch, side: THREE.DoubleSide, clippingPlanes: [], stencilWrite: true, stencilRef: 0, stencilFunc: THREE.NotEqualStencilFunc,
      stencilFail: THREE.ZeroStencilOp, stencilZFail: THREE.ZeroStencilOp, stencilZPass: THREE.ZeroStencilOp }));
    this.capScene.add(this.cap);
    this.filling = new THREE.MeshBasicMaterial({ map: hatch.clone(), vertexColors: true, side: THREE.DoubleSide, clippingPlanes: [] });
  }

  // --- What comes ---

  receive(message) {
    this.stats.bytes += message.size;
    this.stats.messages += 1;
    if (message.kind === 'region' || message.kind === 'piece') this.receiveTriangles(message);
    else if (message.kind === 'fresh') this.receiveFresh(message);
    else if (message.kind === 'model') this.receiveModel(message);
    else if (message.kind === 'shown') this.receiveEnd(message);
    else if (message.kind === 'section') this.receiveSection(message);
    this.invalidate();
  }

  /** Messages of another run, or of another connection, replace all at once when they are complete. */
  forgetRun() {
    this.run = -1;
    this.coming = null;
  }

  /** Whether a message is of another run than what is shown: then that comes in its place, once it is complete. */
  comesInItsPlace(message) {
    if (message.run === this.run || this.regions.size + this.pieces.size === 0) return false;
    if (this.coming?.run !== message.run) this.coming = { run: message.run, messages: new Map(), model: null };
    return true;
  }

  receiveTriangles(message) {
    if (this.comesInItsPlace(message)) {
      this.coming.messages.set(`${message.kind} ${message.region ?? message.piece}`, message);
      return;
    }
    this.run = message.run;
    if (message.kind === 'region') this.addRegion(message);
    else this.addPiece(message);
    this.changeSoon();
  }

  /** Cells that have been found since the picture: it is added to until the next one comes. */
  receiveFresh(message) {
    if (message.run === this.run && !this.coming) this.addRegion(message);
  }

  /** What a plane cuts open: it replaces what it did before. */
  receiveSection(message) {
    this.sections[message.axis]?.mesh?.geometry.dispose();
    this.sections[message.axis] = { message, mesh: null, looks: '' };
  }

  receiveModel(message) {
    if (this.comesInItsPlace(message)) this.coming.model = message;
    else this.setModel(message);
  }

  setModel(message) {
    this.looks += 1;
    const had = JSON.stringify([this.model.parts, this.model.colours]);
    this.model = message;
    if (message.dimension === 2)
      this.undecided.side = THREE.DoubleSide;
    if (message.lower.length > 0) {
      const at = (corner) => new THREE.Vector3(corner[0], corner[1], corner[2] ?? 0);
      this.box.set(at(message.lower), at(message.upper));
      if (!this.isPlaced) this.placeFirst(message);
    }
    if (JSON.stringify([message.parts, message.colours]) !== had) this.colourAll();
    this.updateClips();
    this.onChange('model');
  }

  receiveEnd(message) {
    if (this.coming && this.coming.run === message.run) {
      const { messages, model } = this.coming;
      this.coming = null;
      this.dropAll();
      this.run = message.run;
      if (model) this.setModel(model);
      for (const each of messages.values()) each.kind === 'region' ? this.addRegion(each) : this.addPiece(each);
    }
    this.run = message.run;
    for (const item of [...this.regions.values()]) if (item.message.ofStep <= message.ofStep) this.drop(this.regions, item);
    this.hasSurface = message.surface;
    this.solidVolumes = message.arrays.solidVolumes ?? [];
    if (!message.surface) for (const piece of [...this.pieces.values()]) this.drop(this.pieces, piece);
    this.updateVisibility();
    this.stats.final = message.final;
    this.onChange('shown');
  }

  dropAll() {
    for (const map of [this.regions, this.pieces]) for (const item of [...map.values()]) this.drop(map, item);
    this.select([]);
  }

  drop(map, item) {
    this.blocks.changed(item);
    for (const object of item.objects) { this.scene.remove(object); object.geometry.dispose(); }
    map.delete(item.number);
  }

  /** A region: one mesh for what is IN, one for what is FUZZY. */
  addRegion(message) {
    const number = message.kind === 'fresh' ? `fresh ${message.number}` : message.region;
    const old = this.regions.get(number);
    if (old) this.drop(this.regions, old);
    const a = message.arrays;
    const item = { kind: 'region', number, message, objects: [], partsOf: a.parts, tints: a.tints };
    if (a.triangles.length === 0) return;
    const position = new THREE.BufferAttribute(a.positions, 3);
    const colour = new THREE.BufferAttribute(new Uint8Array(4 * a.parts.length), 4, true);
    const mesh = (indices, material, layer) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', position);
      geometry.setAttribute('color', colour);
      geometry.setIndex(new THREE.BufferAttribute(indices, 1));
      return this.place(item, new THREE.Mesh(geometry, material), layer, message);
    };
    item.indices = a.triangles.subarray(0, 3 * message.opaque);
    const rest = a.triangles.subarray(3 * message.opaque);
    if (item.indices.length > 0) item.solid = mesh(item.indices, this.ofVertices, solids);
    if (rest.length > 0) { item.fuzzy = mesh(rest, this.undecided, 0); item.fuzzy.renderOrder = 2; }
    if (item.solid) item.net = this.place(item, new THREE.Mesh(item.solid.geometry, this.net), 0, message);
    item.centre = middleOf(message.box);
    this.regions.set(number, item);
    this.colour(item);
    this.filter(item);
    if (this.regions.size === 1) this.updateVisibility(); // in the place of the surface
    else this.updateOf(item);
    if (this.stats.firstPicture === 0) this.stats.firstPicture = performance.now();
  }

  /** A piece of the surface, all of one part, with its edges. */
  addPiece(message) {
    const old = this.pieces.get(message.piece);
    if (old) this.drop(this.pieces, old);
    const a = message.arrays;
    const item = { kind: 'piece', number: message.piece, message, part: message.part, objects: [] };
    // All pieces about one place, as the graphics card computes: what they share is drawn at the same pixels.
    const place = { origin: this.box.getCenter(new THREE.Vector3()).toArray(), step: 1 };
    const spread = (places) => new THREE.BufferAttribute(Float32Array.from(places, (x, i) => message.origin[i % 3] + message.step * x - place.origin[i % 3]), 3);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', spread(a.positions));
    geometry.setIndex(new THREE.BufferAttribute(a.triangles, 1));
    item.solid = this.place(item, new THREE.Mesh(geometry, this.materialOf(colours.stone)), solids, place);
    item.net = this.place(item, new THREE.Mesh(geometry, this.net), 0, place);
    if (a.edges.length > 0) {
      const lines = new THREE.BufferGeometry();
      lines.setAttribute('position', geometry.getAttribute('position'));
      lines.setIndex(new THREE.BufferAttribute(a.edges, 1));
      item.lines = this.place(item, new THREE.LineSegments(lines, this.lines), 0, place);
    }
    item.centre = middleOf(message.box);
    this.pieces.set(message.piece, item);
    this.colour(item);
    this.updateOf(item);
    if (this.stats.firstPicture === 0) this.stats.firstPicture = performance.now();
  }

  place(item, object, layer, { origin, step }) {
    object.layers.set(layer);
    object.scale.setScalar(step);
    object.userData = { item, origin: new THREE.Vector3(...origin) };
    object.position.copy(object.userData.origin);
    object.visible = false;
    item.objects.push(object);
    this.scene.add(object);
    return object;
  }

  /** The panel need not be told of each message. */
  changeSoon() {
    if (this.willChange) return;
    this.willChange = true;
    setTimeout(() => { this.willChange = false; this.onChange('content'); }, 60);
  }

  // --- How it looks ---

  materialOf(colour) {
    const key = colours.hex(colour);
    if (!this.ofColour.has(key))
      this.ofColour.set(key, new THREE.MeshLambertMaterial({ color: key, side: this.ofVertices.side, flatShading: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, clippingPlanes: this.planes }));
    return this.ofColour.get(key);
  }

  /** Of a part, as colours are told now. */
  colourOfPart(part) {
    if (this.look.shade === 'part') return colours.ofNumber(part);
    if (this.look.shade === 'colour') return this.model.parts[part]?.colour ?? this.onlyColour() ?? colours.stone;
    if (this.look.shade === 'label') return [120, 166, 110];
    return colours.stone;
  }

  onlyColour() { return this.model.colours.length === 1 ? this.model.colours[0] : null; }

  colour(item) {
    if (item.kind === 'piece') {
      item.solid.material = this.materialOf(this.colourOfPart(item.part));
      return;
    }
    const { message, partsOf, tints } = item;
    const attribute = item.objects[0].geometry.getAttribute('color');
    const known = new Map();
    const colourOf = (part, tint) => {
      const key = part * 65536 + tint;
      if (known.has(key)) return known.get(key);
      let colour;
      if (this.look.shade === 'region') colour = colours.ofNumber(message.region);
      else if (this.look.shade === 'rank') colour = colours.ofNumber(message.rank);
      else if (this.look.shade === 'colour' && tint !== nobody) colour = this.model.colours[tint] ?? colours.stone;
      else colour = this.colourOfPart(partOf(part));
      known.set(key, colours.linear(colour));
      return known.get(key);
    };
    for (let i = 0; i < partsOf.length; ++i) {
      const [r, g, b] = colourOf(partsOf[i], tints ? tints[i] : nobody);
      attribute.array.set([r, g, b, 255], 4 * i);
    }
    attribute.needsUpdate = true;
    this.blocks.changed(item);
  }

  colourAll() {
    this.looks += 1;
    for (const map of [this.regions, this.pieces]) for (const item of map.values()) this.colour(item);
    this.invalidate();
  }

  /** Leaves out the triangles of parts that are hidden. */
  filter(item) {
    if (item.kind !== 'region' || !item.solid) return;
    const all = item.indices;
    let kept = all;
    if (this.hidden.size > 0) {
      const numbers = new Set([...this.hidden].map((part) => (part === noPart ? nobody : part)));
      kept = new all.constructor(all.length);
      let count = 0;
      for (let i = 0; i < all.length; i += 3)
        if (!numbers.has(item.partsOf[all[i]])) { kept[count++] = all[i]; kept[count++] = all[i + 1]; kept[count++] = all[i + 2]; }
      kept = kept.subarray(0, count);
    }
    if (item.solid.geometry.index.array === kept) return;
    item.solid.geometry.dispose();
    item.solid.geometry.setIndex(new THREE.BufferAttribute(kept, 1));
    this.blocks.changed(item);
  }

  hide(parts) {
    this.hidden = new Set(parts);
    for (const region of this.regions.values()) this.filter(region);
    this.updateVisibility();
  }

  /** Cells that have not been seen yet come when they are wanted: the surface stays until then. */
  get showsSurface() { return this.hasSurface && (this.wantsSurface || this.regions.size === 0); }

  /** Else cells. What is told of regions is told of cells, and a surface of one part cannot be moved apart. */
  get wantsSurface() {
    const { what, shade, explode } = this.look;
    if (what === 'cells' || shade === 'region' || shade === 'rank') return false;
    return explode === 0 || this.model.parts.length > 1;
  }

  updateOf(item) {
    const isPiece = item.kind === 'piece';
    const shown = isPiece === this.showsSurface && !(isPiece && this.hidden.has(item.part));
    if (item.solid) item.solid.visible = shown && item.solid.geometry.index.count > 0;
    if (item.net) item.net.visible = shown && this.look.mesh && item.solid.visible;
    if (item.lines) item.lines.visible = shown && this.look.wire;
    if (item.fuzzy) item.fuzzy.visible = this.look.fuzzy;
    const offset = this.offsetOf(item);
    for (const object of item.objects) { object.position.copy(object.userData.origin).add(offset); object.updateMatrixWorld(); }
  }

  /** How far it is moved by what is exploded: regions of cells; parts of a surface, or solids if there is one part. */
  offsetOf(item) {
    if (this.look.explode === 0) return new THREE.Vector3();
    const middle = this.box.getCenter(new THREE.Vector3());
    const own = item.kind === 'piece' ? this.centreOfPart(item.part) : item.centre;
    return own.clone().sub(middle).multiplyScalar(this.look.explode);
  }

  centreOfPart(part) {
    const box = new THREE.Box3();
    for (const piece of this.pieces.values()) if (piece.part === part) box.expandByPoint(piece.centre);
    return box.isEmpty() ? this.box.getCenter(new THREE.Vector3()) : box.getCenter(new THREE.Vector3());
  }

  updateVisibility() {
    this.looks += 1;
    for (const map of [this.regions, this.pieces]) for (const item of map.values()) this.updateOf(item);
    this.selected.visible = this.look.explode === 0;
    this.invalidate();
  }

  setLook(look) {
    const before = this.look;
    this.look = { ...before, ...look };
    if (this.look.parallel !== before.parallel) this.setParallel(this.look.parallel);
    if (this.look.shade !== before.shade) this.colourAll();
    this.updateVisibility();
  }

  setDark(isDark) {
    const ink = isDark ? 0x0c1014 : 0x1b232b;
    this.lines.color.set(ink);
    this.net.color.set(ink);
    this.invalidate();
  }

  /** What is undecided stays translucent, however many regions are behind each other. */
  updateFuzzy() {
    let regions = 0;
    for (const region of this.regions.values()) if (region.fuzzy) regions += 1;
    this.undecided.opacity = Math.min(0.3, Math.max(0.06, 0.55 / Math.cbrt(Math.max(1, regions))));
  }

  // --- Sections ---

  updateClips() {
    this.planes.length = 0;
    for (const clip of this.clips) {
      clip.plane = null;
      if (!clip.on || this.box.isEmpty()) continue;
      const { axis } = clip;
      // A little beside where it is asked for: faces that lie in the plane would be counted or not as rounding goes.
      const at = this.box.min[axis] + (clip.at + 1.7e-5) * (this.box.max[axis] - this.box.min[axis]);
      const normal = new THREE.Vector3();
      normal[axis] = clip.flip === (axis === 'y') ? -1 : 1; // at first the cut is seen from the front, the right and above
      clip.plane = new THREE.Plane(normal, -normal[axis] * at);
      clip.place = at;
      this.planes.push(clip.plane);
    }
    this.seeBacks();
    this.invalidate();
  }

  isKept(point, planes = this.planes) { return planes.every((plane) => plane.distanceToPoint(point) >= -1e-9 * this.sphere().radius); }

  /** What is cut open is looked into: there is less than a pixel between what fills it and what is behind. */
  seeBacks() {
    const side = this.planes.length > 0 || this.model.dimension === 2 ? THREE.DoubleSide : THREE.FrontSide;
    for (const material of [this.ofVertices, ...this.ofColour.values()]) {
      if (material.side === side) continue;
      material.side = side;
      material.needsUpdate = true;
    }
  }

  /** Fills what planes cut open, as bsp2 has told; until it has, by counting. */
  drawCaps() {
    const counted = [];
    for (const [axis, { plane }] of this.clips.entries()) {
      if (!plane) continue;
      const filling = this.fillingOf(axis);
      if (filling === null) { counted.push(plane); continue; }
      this.filling.clippingPlanes = this.planes.filter((other) => other !== plane);
      this.cap.visible = false;
      this.capScene.add(filling);
      this.camera.layers.enable(0);
      this.renderer.render(this.capScene, this.camera);
      this.capScene.remove(filling);
      this.cap.visible = true;
    }
    if (counted.length > 0) this.countCaps(counted);
  }

  /** What fills the section across an axis; null if what there is is not of what is shown now. */
  fillingOf(axis) {
    const section = this.sections[axis], { place } = this.clips[axis];
    if (!section || section.message.run !== this.run || section.message.at !== place || section.message.explode !== this.look.explode) return null;
    if (section.message.surface !== this.showsSurface || [...this.regions.keys()].some((number) => typeof number === 'string')) return null;
    const looks = [this.looks, this.regions.size, this.pieces.size].join(); // of regions that have not come nothing is filled
    if (section.looks !== looks) {
      section.mesh?.geometry.dispose();
      section.mesh = this.filled(section.message);
      section.looks = looks;
    }
    return section.mesh;
  }

  filled({ axis, at, middle, surface, arrays: { corners, counts, regions, parts } }) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    const positions = [], colour = [], places = [], indices = [], owners = [];
    const period = this.box.getSize(new THREE.Vector3()).length() * 1.2 / 70 || 1;
    let first = 0;
    counts.forEach((count, i) => {
      const begin = 8 * first;
      first += count;
      const item = surface ? { kind: 'piece', part: parts[i] } : this.regions.get(regions[i]);
      if (!item || this.hidden.has(parts[i])) return;
      const offset = this.offsetOf(item).toArray();
      const { shade } = this.look;
      const own = shade === 'region' ? colours.ofNumber(item.message.region) : shade === 'rank' ? colours.ofNumber(item.message.rank) : this.colourOfPart(parts[i]);
      const rgb = colours.linear(own);
      for (let at8 = begin; at8 < begin + 8 * count; at8 += 2) {
        const point = [0, 0, 0];
        point[axis] = at - middle[axis];
        point[u] = corners[at8] + offset[u];
        point[v] = corners[at8 + 1] + offset[v];
        if ((at8 - begin) % 8 === 0) { const k = positions.length / 3; indices.push(k, k + 1, k + 2, k, k + 2, k + 3); owners.push(i); }
        positions.push(...point);
        colour.push(...rgb, 255);
        places.push(point[u] / period, point[v] / period);
      }
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(Uint8Array.from(colour), 4, true));
    geometry.setAttribute('uv', new THREE.Float32BufferAttribute(places, 2));
    geometry.setIndex(indices);
    const mesh = new THREE.Mesh(geometry, this.filling);
    mesh.position.set(...middle);
    mesh.updateMatrixWorld();
    mesh.userData = { axis, parts: owners.map((i) => parts[i]), regions: surface ? null : owners.map((i) => regions[i]) };
    return mesh;
  }

  /** Fills what planes cut open: where more backs than fronts lie behind a plane, it is in the solid. */
  countCaps(planes) {
    const items = [...(this.showsSurface ? this.pieces : this.regions).values()].filter((item) => item.solid?.visible);
    const parts = new Map();
    for (const item of items) {
      const key = item.kind === 'piece' ? item.part : 'all';
      parts.set(key, [...(parts.get(key) ?? []), item]);
    }
    const groups = parts.size <= 24 ? [...parts] : [['all', items]];
    const size = this.box.getSize(new THREE.Vector3()).length() * (1.2 + this.look.explode) || 1;
    const { camera } = this;
    const wasVisible = new Map(items.map((item) => [item, true]));
    for (const [part, own] of groups) {
      for (const item of wasVisible.keys()) item.solid.visible = false;
      for (const item of own) item.solid.visible = true;
      for (const plane of planes) {
        this.renderer.clearStencil();
        camera.layers.set(solids);
        for (const material of [this.backs, this.fronts]) {
          material.clippingPlanes = [plane];
          this.scene.overrideMaterial = material;
          this.renderer.render(this.scene, camera);
        }
        this.scene.overrideMaterial = null;
        camera.layers.enable(0);
        plane.coplanarPoint(this.cap.position);
        const middle = this.box.getCenter(new THREE.Vector3());
        plane.projectPoint(middle, this.cap.position);
        this.cap.lookAt(this.cap.position.clone().add(plane.normal));
        this.cap.scale.setScalar(size);
        this.cap.material.map.repeat.setScalar(70);
        this.cap.material.color.set(colours.hex(part === 'all' ? colours.stone : this.colourOfPart(part)));
        this.cap.material.clippingPlanes = this.planes.filter((other) => other !== plane);
        this.renderer.render(this.capScene, camera);
      }
    }
    for (const item of wasVisible.keys()) item.solid.visible = true;
  }

  // --- Camera ---

  placeFirst(message) {
    this.isPlaced = true;
    if (message.dimension === 2) this.view('top');
    else if (message.eye?.length === 3 && !this.isAsked) { this.camera.position.set(...message.eye); this.controls.target.copy(this.box.getCenter(new THREE.Vector3())); this.controls.update(); }
    else if (!this.isAsked) this.view('iso');
  }

  /** Looks from a direction at all there is, or at where it looks now. */
  view(name, keepsDistance = false) {
    const cos = Math.cos, sin = Math.sin, rad = Math.PI / 180;
    const iso = new THREE.Vector3(sin(30 * rad) * cos(22 * rad), -cos(30 * rad) * cos(22 * rad), sin(22 * rad));
    const directions = { front: [0, -1, 0], back: [0, 1, 0], left: [-1, 0, 0], right: [1, 0, 0], top: [0, -1e-4, 1], bottom: [0, -1e-4, -1], iso: iso.toArray() };
    const direction = new THREE.Vector3(...(directions[name] ?? directions.iso)).normalize();
    this.fit(direction, keepsDistance);
  }

  fit(direction = this.camera.position.clone().sub(this.controls.target).normalize()) {
    const sphere = this.sphere();
    const half = Math.min(this.perspective.fov, 2 * Math.atan(Math.tan(this.perspective.fov * Math.PI / 360) * this.aspect()) * 180 / Math.PI) * Math.PI / 360;
    this.controls.target.copy(sphere.center);
    this.camera.position.copy(sphere.center).addScaledVector(direction, sphere.radius / Math.sin(half) * 1.02);
    this.parallel.zoom = 1;
    const tall = sphere.radius * 1.05 / Math.min(1, this.aspect());
    Object.assign(this.parallel, { top: tall, bottom: -tall });
    this.resize();
    this.controls.update();
    this.invalidate();
    this.onChange();
  }

  aspect() { return (this.canvas.clientWidth || 1) / (this.canvas.clientHeight || 1); }

  sphere() {
    const sphere = this.box.isEmpty() ? new THREE.Sphere(new THREE.Vector3(), 1) : this.box.getBoundingSphere(new THREE.Sphere());
    sphere.radius = Math.max(sphere.radius, 1e-9) * (1 + this.look.explode);
    return sphere;
  }

  setParallel(isParallel) {
    const from = this.camera, to = isParallel ? this.parallel : this.perspective;
    if (from === to) return;
    const distance = from.position.distanceTo(this.controls.target);
    const tall = Math.tan(this.perspective.fov * Math.PI / 360);
    to.position.copy(from.position);
    if (isParallel) {
      Object.assign(this.parallel, { top: distance * tall, bottom: -distance * tall, zoom: 1 });
    } else {
      const wanted = this.parallel.top / this.parallel.zoom / tall;
      to.position.sub(this.controls.target).setLength(wanted).add(this.controls.target);
    }
    this.camera = this.controls.object = to;
    this.resize();
    this.controls.update();
  }

  turn(across, up) {
    const arm = this.camera.position.clone().sub(this.controls.target);
    const at = new THREE.Spherical().setFromVector3(new THREE.Vector3(arm.x, arm.z, -arm.y));
    at.theta += across;
    at.phi = Math.min(Math.PI - 1e-4, Math.max(1e-4, at.phi + up));
    const to = new THREE.Vector3().setFromSpherical(at);
    this.camera.position.set(to.x, -to.z, to.y).add(this.controls.target);
    this.controls.update();
  }

  zoom(factor) {
    if (this.camera.isOrthographicCamera) { this.camera.zoom *= factor; this.camera.updateProjectionMatrix(); }
    else this.camera.position.sub(this.controls.target).divideScalar(factor).add(this.controls.target);
    this.controls.update();
    this.invalidate();
    this.onChange();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.perspective.aspect = width / height;
    Object.assign(this.parallel, { left: this.parallel.bottom * width / height, right: this.parallel.top * width / height });
    this.invalidate();
  }

  // --- Picking ---

  /** What is under a place of the canvas, in [-1, 1]: a face or a cell; null if nothing is. */
  pick(x, y) {
    const ray = new THREE.Raycaster();
    ray.layers.set(solids);
    ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
    const meshes = [];
    for (const map of [this.regions, this.pieces])
      for (const item of map.values()) if (item.solid?.visible) meshes.push(item.solid);
    const hits = this.hitsOf(ray, meshes);
    const hit = hits.find(({ point }) => this.isKept(point));
    const cut = this.pickSection(ray, hit?.distance ?? Infinity);
    if (cut) return cut;
    if (!hit) return null;
    const picked = Object.assign(this.describe(hit), { ray });
    if (hit.face.normal.dot(ray.ray.direction) > 0 && this.planes.length > 0) {
      const section = this.planes.map((plane) => [plane, ray.ray.intersectPlane(plane, new THREE.Vector3())])
        .filter(([, point]) => point && this.isKept(point) && point.distanceTo(ray.ray.origin) < hit.distance)
        .sort((a, b) => a[1].distanceTo(ray.ray.origin) - b[1].distanceTo(ray.ray.origin)).pop();
      if (section) Object.assign(picked, { kind: 'section', point: section[1], normal: section[0].normal.clone(), triangles: null });
    }
    return picked;
  }

  /** What fills a section, where a ray meets it nearer than anything else. */
  pickSection(ray, least) {
    let nearest = null;
    for (const [axis, { plane }] of this.clips.entries()) {
      const filling = plane && this.model.dimension === 3 ? this.fillingOf(axis) : null;
      if (!filling) continue;
      const hits = [];
      filling.raycast(ray, hits);
      const others = this.planes.filter((other) => other !== plane);
      for (const hit of hits) if (this.isKept(hit.point, others) && hit.distance < (nearest?.hit.distance ?? least)) nearest = { hit, plane, filling };
    }
    if (nearest === null) return null;
    const { hit: { point, faceIndex }, plane, filling: { userData: { parts, regions } } } = nearest;
    const owner = faceIndex >> 1;
    const item = regions ? this.regions.get(regions[owner]) : [...this.pieces.values()].find((piece) => piece.part === parts[owner]);
    return item ? { kind: 'section', point, normal: plane.normal.clone(), item, part: parts[owner], run: this.run, triangles: null, ray } : null;
  }

  /** Backs count, too: the first thing behind a plane that cuts a solid open is one. */
  hitsOf(ray, meshes) {
    const materials = [this.ofVertices, ...this.ofColour.values()];
    const sides = materials.map((material) => material.side);
    for (const material of materials) material.side = THREE.DoubleSide;
    const hits = ray.intersectObjects(meshes, false);
    materials.forEach((material, i) => { material.side = sides[i]; });
    return hits;
  }

  /**
   * What was picked, in what has come in the place of its piece or region: the same ray meets the same face there. Of voxels it is what
   * the ray meets first; null if that is nothing.
   */
  pickedAnew(picked) {
    const item = (picked.item.kind === 'piece' ? this.pieces : this.regions).get(picked.item.number);
    if (!item || item === picked.item || picked.kind === 'section' || !item.solid?.visible) return picked;
    const hits = this.hitsOf(picked.ray, [item.solid]).filter(({ point }) => this.isKept(point)).map((hit) => this.describe(hit));
    if (picked.item.message.voxels) return item.message.voxels ? picked : hits[0] ? Object.assign(hits[0], { ray: picked.ray }) : null;
    const same = hits.find(({ face, volume }) => (item.kind === 'piece' ? face === picked.face : volume === picked.volume));
    return same ? Object.assign(same, { ray: picked.ray }) : { ...picked, item, triangles: null };
  }

  describe(hit) {
    const { item } = hit.object.userData;
    const { arrays, origin, step } = item.message;
    const picked = { point: hit.point, normal: hit.face.normal.clone(), item, run: this.run };
    if (item.kind === 'piece') {
      const [owner, first, count] = ownerOf(arrays.ofFace, hit.faceIndex);
      return Object.assign(picked, { kind: 'face', part: item.part, face: arrays.faces[owner], area: arrays.areas[owner],
        solid: arrays.solids[owner], solidVolume: this.solidVolumes[arrays.solids[owner]], triangles: arrays.triangles.subarray(3 * first, 3 * (first + count)) });
    }
    // Triangles of hidden parts are left out of what is drawn: find the one among all.
    const drawn = item.solid.geometry.index.array;
    const corner = 3 * hit.faceIndex;
    let triangle = hit.faceIndex;
    if (drawn !== item.indices)
      while (item.indices[3 * triangle] !== drawn[corner] || item.indices[3 * triangle + 1] !== drawn[corner + 1] || item.indices[3 * triangle + 2] !== drawn[corner + 2]) ++triangle;
    const [cell, first, count] = ownerOf(arrays.ofCell, triangle);
    return Object.assign(picked, { kind: 'cell', part: arrays.cellParts[cell], cell, region: item.message.region, rank: item.message.rank,
      level: arrays.levels[cell], volume: arrays.volumes[cell], triangles: arrays.triangles.subarray(3 * first, 3 * (first + count)), origin, step });
  }

  /** Marks what is picked, and whole parts. */
  select(picks, part = null) {
    for (const object of [...this.selected.children]) { this.selected.remove(object); if (!object.userData.isShared) object.geometry.dispose(); }
    const add = (geometry, like, isShared) => {
      const object = new THREE.Mesh(geometry, this.marked);
      object.position.copy(like.position);
      object.scale.copy(like.scale);
      object.renderOrder = 3;
      object.userData.isShared = isShared;
      this.selected.add(object);
    };
    for (const picked of picks) {
      if (!picked.triangles) continue;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', picked.item.solid.geometry.getAttribute('position'));
      geometry.setIndex(new THREE.BufferAttribute(picked.triangles.slice(), 1));
      add(geometry, picked.item.solid, false);
    }
    if (part !== null)
      for (const piece of this.pieces.values()) if (piece.part === part && piece.solid.visible) add(piece.solid.geometry, piece.solid, true);
    if (picks.length > 0) {
      const places = new THREE.BufferGeometry().setFromPoints(picks.map(({ point }) => point));
      const look = { color: 0x0b66c3, depthTest: false, transparent: true };
      for (const object of [new THREE.Line(places, new THREE.LineBasicMaterial(look)), new THREE.Points(places, new THREE.PointsMaterial({ ...look, size: 7, sizeAttenuation: false }))]) {
        object.renderOrder = 4;
        this.selected.add(object);
      }
    }
    this.invalidate();
  }

  // --- Drawing ---

  invalidate() { this.isStale = true; }

  /** The camera sees from a little before all there is to behind it. */
  fitDepth() {
    const sphere = this.sphere();
    const distance = this.camera.position.distanceTo(sphere.center);
    this.camera.near = Math.max(distance - 1.5 * sphere.radius, this.camera.isOrthographicCamera ? -1e6 * sphere.radius : distance / 2000, this.camera.isOrthographicCamera ? -Infinity : sphere.radius / 2000);
    this.camera.far = distance + 1.5 * sphere.radius;
    this.camera.updateProjectionMatrix();
  }

  draw() {
    const start = performance.now();
    this.isStale = false;
    const sphere = this.sphere();
    this.fitDepth();
    const direction = (x, y, z) => new THREE.Vector3(x, y, z).applyQuaternion(this.camera.quaternion).multiplyScalar(sphere.radius || 1);
    this.lamp.position.copy(sphere.center).add(direction(-0.6, 0.9, 1));
    this.side.position.copy(sphere.center).add(direction(1, -0.2, 0.6));
    for (const light of [this.lamp, this.side]) light.target.position.copy(sphere.center);
    this.renderer.info.autoReset = false;
    this.renderer.info.reset();
    this.renderer.clear();
    this.updateFuzzy();
    this.blocks.update();
    if (this.planes.length > 0 && this.model.dimension === 3) this.drawCaps();
    this.renderer.render(this.scene, this.camera);
    this.stats.triangles = this.renderer.info.render.triangles;
    this.stats.calls = this.renderer.info.render.calls;
    const script = performance.now() - start;
    this.stats.frames += 1;
    this.stats.longest = Math.max(this.stats.longest, script);
    this.stats.script = this.stats.frames === 1 ? script : 0.9 * this.stats.script + 0.1 * script;
    this.onChange('drawn');
  }
}

/** Where something is when nothing is exploded, at any level. */
function middleOf([lower, upper]) { return new THREE.Vector3(...lower).add(new THREE.Vector3(...upper)).multiplyScalar(0.5); }

/** Whose the triangle is, and which are his: [owner, first, count]. */
function ownerOf(counts, triangle) {
  let first = 0;
  for (let owner = 0; owner < counts.length; ++owner) {
    if (triangle < first + counts[owner]) return [owner, first, counts[owner]];
    first += counts[owner];
  }
  return [counts.length - 1, first, 0];
}

/** Lines at 45 degrees on white. */
function hatching() {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#ffffff';
  pen.fillRect(0, 0, 64, 64);
  pen.strokeStyle = 'rgba(20, 26, 33, 0.45)';
  pen.lineWidth = 4;
  for (const shift of [-64, -32, 0, 32, 64]) { pen.beginPath(); pen.moveTo(shift - 4, 68); pen.lineTo(shift + 68, -4); pen.stroke(); }
  return canvas;
}
