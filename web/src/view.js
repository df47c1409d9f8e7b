// The page of bsp2 view: what is around the stage, and what the address remembers.
import * as THREE from 'three';
import { connect } from './protocol.js';
import { Gaze, gazeOf } from './gaze.js';
import { Stage } from './stage.js';
import * as colours from './colours.js';

const $ = (id) => document.getElementById(id);
const eyes = '<svg viewBox="0 0 20 20"><path d="M2 10s3-5 8-5 8 5 8 5-3 5-8 5-8-5-8-5z" class="lid"/><circle cx="10" cy="10" r="2.4" class="open"/></svg>';
const viewNames = ['iso', 'front', 'back', 'left', 'right', 'top', 'bottom'];

/** Numbers as people read them. */
const number = (x, digits = 6) => (x === 0 ? '0' : Math.abs(x) >= 1e9 || Math.abs(x) < 1e-4 ? x.toExponential(4) : Number(x.toPrecision(digits)).toLocaleString('en', { maximumFractionDigits: 8 }));
const count = (n) => n.toLocaleString('en');
const bytes = (n) => (n >= 2 ** 30 ? `${(n / 2 ** 30).toFixed(1)} GiB` : `${Math.round(n / 2 ** 20)} MiB`);
const time = (s) => (s < 10 ? `${s.toFixed(1)} s` : s < 90 ? `${Math.round(s)} s` : `${Math.floor(s / 60)}:${String(Math.round(s) % 60).padStart(2, '0')} min`);

function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key === 'style') Object.assign(made.style, value);
    else if (key in made) made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

function facts(rows) {
  const list = element('dl');
  for (const [name, value] of rows) if (value !== undefined && value !== null) list.append(element('dt', { textContent: name }), element('dd', { textContent: value }));
  return list;
}

let stage;
try {
  stage = new Stage($('canvas'), changed);
} catch (error) {
  $('error').hidden = false;
  $('error').textContent = `This browser cannot draw the model: it has no WebGL (${error.message}).`;
  throw error;
}

let picks = [];
let selectedPart = null;
let connection = 'connecting';
let progress = { state: '' };
let figures = null;
let rate = 0;
let rateOf = null;

// --- Parts ---

/** Numbers of the parts that there are to be seen. */
function partNumbers() {
  const names = stage.model.parts;
  if (names.length > 0) return names.map((_, i) => i);
  return [];
}

const nameOf = (part) => (stage.model.parts[part]?.name ?? (part < 0 ? 'without a name' : 'the solid'));

function swatchOf(part) {
  const shade = stage.look.shade;
  return shade === 'part' || shade === 'colour' ? stage.colourOfPart(part) : colours.stone;
}

function listParts() {
  const list = $('parts');
  const numbers = partNumbers();
  const wanted = $('filter').value.trim().toLowerCase();
  $('filter').hidden = numbers.length < 12;
  $('showall').hidden = stage.hidden.size === 0;
  const rows = (numbers.length > 0 ? numbers : [0]).filter((part) => nameOf(part).toLowerCase().includes(wanted)).slice(0, 2000);
  list.replaceChildren(...rows.map((part) => {
    const info = stage.model.parts[part];
    const isOff = stage.hidden.has(part);
    const name = numbers.length > 0 ? nameOf(part) : stage.model.name ?? 'The solid';
    const eye = element('button', { innerHTML: eyes, title: isOff ? 'Show' : 'Hide', ariaLabel: `${isOff ? 'Show' : 'Hide'} ${name}`, ariaPressed: String(!isOff) });
    eye.onclick = (event) => { event.stopPropagation(); toggle(part, event.altKey); };
    const row = element('li', { role: 'treeitem', tabIndex: 0, className: isOff ? 'off' : '', title: name, ariaSelected: String(selectedPart === part) },
      element('span', { className: 'swatch', style: { background: colours.css(swatchOf(part)) } }),
      element('span', { className: 'what', textContent: name }),
      element('span', { className: 'much', textContent: info?.volume === undefined ? '' : number(info.volume, 4) }), eye);
    row.dataset.part = part;
    row.onclick = () => selectPart(selectedPart === part ? null : part);
    row.ondblclick = () => isolate(part);
    row.onkeydown = (event) => {
      if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); selectPart(part); }
      if (event.key === 'ArrowDown') row.nextElementSibling?.focus();
      if (event.key === 'ArrowUp') row.previousElementSibling?.focus();
    };
    return row;
  }));
}

function setHidden(parts) {
  stage.hide(parts);
  picks = picks.filter((picked) => !stage.hidden.has(picked.part));
  if (stage.hidden.has(selectedPart)) selectedPart = null;
  showSelection();
  listParts();
  remember();
}

function toggle(part, alone) {
  if (alone) { isolate(part); return; }
  const hidden = new Set(stage.hidden);
  if (!hidden.delete(part)) hidden.add(part);
  setHidden(hidden);
}

function isolate(part) {
  const all = partNumbers();
  if (all.length < 2) return;
  const isAlone = stage.hidden.size === all.length - 1 && !stage.hidden.has(part);
  setHidden(isAlone ? [] : all.filter((other) => other !== part));
}

// --- Selection ---

function selectPart(part) {
  selectedPart = part;
  picks = [];
  showSelection();
  listParts();
}

function describe(picked, title) {
  if (picked.item.message.voxels && picked.kind !== 'section') return [element('h3', { textContent: title }), element('p', { className: 'quiet', textContent: 'Looking nearer ...' })];
  const part = stage.model.parts[picked.part];
  const rows = [['part', stage.model.parts.length > 0 ? nameOf(picked.part) : null], ['part volume', part?.volume === undefined ? null : number(part.volume)]];
  if (picked.kind === 'face') rows.push(['face', picked.face], ['face area', number(picked.area)], ['piece volume', picked.solidVolume === undefined ? null : number(picked.solidVolume)]);
  if (picked.kind === 'cell') rows.push(['cell volume', number(picked.volume)], ['level', picked.level], ['region', picked.region], ['rank', stage.model.ranks > 1 ? picked.rank : null]);
  rows.push(['point', picked.point.toArray().map((x) => number(x, 5)).join(', ')]);
  rows.push(['normal', picked.normal.toArray().map((x) => number(Math.abs(x) < 5e-4 ? 0 : x, 3)).join(', ')]);
  return [element('h3', { textContent: title }), facts(rows)];
}

function showSelection() {
  stage.select(picks, selectedPart);
  $('clear').hidden = picks.length === 0 && selectedPart === null;
  const box = $('picked');
  if (selectedPart !== null) {
    const part = stage.model.parts[selectedPart];
    const volume = part?.volume ?? figures?.volume;
    box.replaceChildren(element('h3', { textContent: nameOf(selectedPart) }), facts([['volume', volume === undefined ? 'not known yet' : number(volume)], ['area', number(areaOf(selectedPart))], ['faces', count(facesOf(selectedPart))]].filter(([name, value]) => name === 'volume' || stage.hasSurface)));
    return;
  }
  if (picks.length === 0) {
    box.replaceChildren(element('p', { className: 'quiet', textContent: 'Click a part or face. Shift-click another one to measure between them.' }));
    return;
  }
  const kinds = { face: 'Face', cell: 'Cell', section: 'Section' };
  const shown = picks.flatMap((picked, i) => describe(picked, picks.length > 1 ? `${i + 1}: ${kinds[picked.kind]}` : kinds[picked.kind]));
  if (picks.length === 2 && !picks.some(({ item, kind }) => item.message.voxels && kind !== 'section')) {
    const [a, b] = picks;
    const d = b.point.clone().sub(a.point);
    const angle = THREE.MathUtils.radToDeg(a.normal.angleTo(b.normal));
    const isParallel = angle < 0.05 || angle > 179.95;
    shown.push(element('h3', { textContent: 'Between them' }), facts([['distance', number(d.length())], ['along x, y, z', d.toArray().map((x) => number(Math.abs(x), 5)).join(', ')],
      ['angle of normals', `${angle.toFixed(2)}°`], ['distance of planes', isParallel ? number(Math.abs(d.dot(a.normal))) : null]]));
  }
  box.replaceChildren(...shown);
  box.scrollIntoView({ block: 'nearest' });
}

function areaOf(part) {
  let area = 0;
  for (const piece of stage.pieces.values()) if (piece.part === part) area += piece.message.area;
  return area;
}
function facesOf(part) {
  let faces = 0;
  for (const piece of stage.pieces.values()) if (piece.part === part) faces += piece.message.ofFaces;
  return faces;
}

let pressed = null;
$('canvas').addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; $('canvas').focus(); });
$('canvas').addEventListener('pointerup', (event) => {
  if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4 || event.button !== 0) return;
  const { left, top, width, height } = $('canvas').getBoundingClientRect();
  const picked = stage.pick((2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height);
  selectedPart = null;
  if (!picked) picks = event.shiftKey ? picks : [];
  else picks = event.shiftKey && picks.length > 0 ? [picks[0], picked] : [picked];
  showSelection();
  listParts();
});
$('clear').onclick = () => { picks = []; selectPart(null); };

// --- Sections ---

function makeClips() {
  $('clips').replaceChildren(...stage.clips.map((clip) => {
    const on = element('input', { type: 'checkbox', checked: clip.on, id: `clip-${clip.axis}` });
    const slider = element('input', { type: 'range', min: 0, max: 1, step: 0.001, value: clip.at, ariaLabel: `Where ${clip.axis} is cut` });
    const where = element('input', { type: 'number', step: 'any', ariaLabel: `${clip.axis} of the section` });
    const flip = element('button', { textContent: '⇄', title: 'Show the other side', ariaLabel: `Other side of ${clip.axis}` });
    const update = () => {
      const [low, high] = [stage.box.min[clip.axis], stage.box.max[clip.axis]];
      if (document.activeElement !== where && high > low) where.value = Number((low + clip.at * (high - low)).toPrecision(5));
      on.checked = clip.on;
      slider.value = clip.at;
      row.hidden = !stage.box.isEmpty() && high === low; // of a plane model
    };
    const changed = () => { update(); stage.updateClips(); remember(); };
    on.onchange = () => { clip.on = on.checked; changed(); };
    slider.oninput = () => { clip.at = Number(slider.value); clip.on = true; changed(); };
    where.onchange = () => {
      const [low, high] = [stage.box.min[clip.axis], stage.box.max[clip.axis]];
      clip.at = Math.min(1, Math.max(0, (Number(where.value) - low) / (high - low || 1)));
      clip.on = true;
      changed();
    };
    flip.onclick = () => { clip.flip = !clip.flip; clip.on = true; changed(); };
    const row = element('div', { className: 'clip' }, element('label', {}, on, clip.axis), slider, where, flip);
    clip.update = update;
    update();
    return row;
  }));
}

// --- Look ---

const checks = { wire: 'wire', mesh: 'mesh', fuzzy: 'fuzzy' };
for (const [id, name] of Object.entries(checks)) $(id).onchange = () => { stage.setLook({ [name]: $(id).checked }); remember(); };
$('shade').onchange = () => { stage.setLook({ shade: $('shade').value }); listParts(); remember(); };
$('what').onchange = () => { picks = []; stage.setLook({ what: $('what').value }); showSelection(); remember(); };
$('explode').oninput = () => { stage.setLook({ explode: Number($('explode').value) }); remember(); };
$('filter').oninput = listParts;
$('showall').onclick = () => setHidden([]);
$('menu').onclick = () => { document.body.classList.toggle('closed'); remember(); };
$('fit').onclick = () => stage.fit();
$('views').onclick = () => { $('viewlist').hidden = !$('viewlist').hidden; };
$('viewlist').append(...viewNames.map((name, i) => {
  const button = element('button', { innerHTML: `${name[0].toUpperCase()}${name.slice(1)} <kbd>${i + 1}</kbd>` });
  button.onclick = () => { stage.view(name); $('viewlist').hidden = true; };
  return button;
}), element('button', { id: 'parallel', innerHTML: 'Parallel <kbd>P</kbd>', onclick: toggleParallel }));
addEventListener('pointerdown', (event) => { if (!event.target.closest('#viewlist, #views')) $('viewlist').hidden = true; });
function toggleParallel() { $('viewlist').hidden = true; stage.setLook({ parallel: !stage.look.parallel }); remember(); }

const prefersDark = matchMedia('(prefers-color-scheme: dark)');
let theme = null; // none: as the system has it
function setTheme() {
  const isDark = theme ? theme === 'dark' : prefersDark.matches;
  document.documentElement.dataset.theme = isDark ? 'dark' : 'light';
  stage.setDark(isDark);
}
prefersDark.addEventListener('change', setTheme);
$('theme').onclick = () => { theme = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark'; setTheme(); remember(); };

// --- Keys ---

const keys = [['arrows', 'turn (with Shift: move sections)'], ['+ −', 'nearer, farther'], ['F', 'show all'], ['1 … 7', 'iso, front, back, left, right, top, bottom'], ['P', 'parallel or perspective'],
  ['X Y Z', 'section on or off'], ['H', 'hide what is selected'], ['I', 'show it alone'], ['A', 'show all parts'], ['W', 'edges'], ['T', 'triangles'], ['E', 'explode'], ['C', 'cells or surface'], ['D', 'dark or light'], ['M', 'the panel'], ['Esc', 'select nothing']];
$('keys').append(element('b', { textContent: 'Keys and mouse' }), (() => {
  const list = element('dl');
  list.append(element('dt', { textContent: 'drag' }), element('dd', { textContent: 'turn; right button or two fingers: move; wheel or pinch: nearer' }), element('dt', { textContent: 'click' }), element('dd', { textContent: 'select a face; Shift-click a second one to measure' }), element('dt', { textContent: 'double click' }), element('dd', { textContent: 'on a part in the list: show it alone' }));
  for (const [key, does] of keys) list.append(element('dt', {}, element('kbd', { textContent: key })), element('dd', { textContent: does }));
  return list;
})(), element('button', { textContent: 'Close', onclick: () => $('keys').close() }));
$('help').onclick = () => $('keys').showModal();

function flip(id) { $(id).checked = !$(id).checked; $(id).onchange(); }
const onKey = {
  f: () => stage.fit(), p: toggleParallel, w: () => flip('wire'), t: () => flip('mesh'), d: () => $('theme').onclick(), a: () => setHidden([]),
  c: () => { $('what').value = $('what').value === 'cells' ? 'auto' : 'cells'; $('what').onchange(); },
  e: () => { $('explode').value = Number($('explode').value) > 0 ? 0 : 0.5; $('explode').oninput(); },
  h: () => { const part = selectedPart ?? picks.at(-1)?.part; if (part !== undefined) toggle(part); },
  i: () => { const part = selectedPart ?? picks.at(-1)?.part; if (part !== undefined) isolate(part); },
  m: () => $('menu').onclick(), '?': () => $('keys').showModal(), '+': () => stage.zoom(1.2), '=': () => stage.zoom(1.2), '-': () => stage.zoom(1 / 1.2),
  Escape: () => { picks = []; $('viewlist').hidden = true; selectPart(null); },
};
for (const [i, axis] of ['x', 'y', 'z'].entries())
  onKey[axis] = () => { const clip = stage.clips[i]; clip.on = !clip.on; clip.update(); stage.updateClips(); remember(); };
addEventListener('pointerdown', () => document.body.classList.remove('keyboard'));
addEventListener('keydown', (event) => {
  if (event.key === 'Tab') document.body.classList.add('keyboard');
  const isTyping = event.target.matches('input:not([type=checkbox]):not([type=range]), select');
  if (isTyping || event.ctrlKey || event.metaKey || event.altKey || $('keys').open) return;
  const hasFocus = document.activeElement === $('canvas') || document.activeElement === document.body;
  if (event.key.startsWith('Arrow') && hasFocus) {
    const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.shiftKey) {
      for (const clip of stage.clips.filter(({ on }) => on)) { clip.at = Math.min(1, Math.max(0, clip.at + 0.01 * (dx - dy))); clip.update(); }
      stage.updateClips();
      remember();
    } else stage.turn((dx * Math.PI) / 36, (dy * Math.PI) / 36);
  } else if (/^[1-7]$/.test(event.key)) stage.view(viewNames[Number(event.key) - 1]);
  else if (onKey[event.key.length === 1 ? event.key.toLowerCase() : event.key]) onKey[event.key.length === 1 ? event.key.toLowerCase() : event.key]();
  else return;
  event.preventDefault();
});

// --- What the address remembers ---

let remembering = 0;
let camera = '';
function remember() {
  clearTimeout(remembering);
  remembering = setTimeout(() => {
    const { look, controls } = stage;
    const brief = (vector) => vector.toArray().map((x) => Number(x.toPrecision(6))).join(',');
    const state = new URLSearchParams();
    const isThere = stage.isPlaced || stage.isAsked; // else the camera is nowhere yet
    if (isThere) {
      state.set('eye', brief(stage.camera.position));
      state.set('at', brief(controls.target));
    }
    if (look.parallel) state.set('parallel', Number((stage.parallel.top / stage.parallel.zoom).toPrecision(6)));
    if (look.shade !== 'colour') state.set('shade', look.shade);
    if (look.what !== 'auto') state.set('show', look.what);
    if (look.explode > 0) state.set('explode', look.explode);
    for (const name of Object.values(checks)) if (look[name] !== (name !== 'mesh')) state.set(name, look[name] ? 1 : 0);
    for (const clip of stage.clips) if (clip.on) state.set(clip.axis, `${Number(clip.at.toFixed(4))}${clip.flip ? '-' : ''}`);
    if (stage.hidden.size > 0) state.set('hide', [...stage.hidden].join('.'));
    if (theme) state.set('theme', theme);
    if (document.body.classList.contains('closed')) state.set('panel', 0);
    const hash = `#${state}`;
    if (location.hash !== hash) history.replaceState(null, '', hash);
    const eye = brief(stage.camera.position);
    if (isThere && eye !== camera) line.say({ eye: eye.split(',').map(Number), at: brief(controls.target).split(',').map(Number) });
    camera = eye;
  }, 150);
}

function recall() {
  const state = new URLSearchParams(location.hash.slice(1));
  const vector = (name) => { const x = (state.get(name) ?? '').split(',').map(Number); return x.length === 3 && x.every((c) => Math.abs(c) < 1e15) ? x : null; }; // beyond that products are no numbers
  const look = { shade: 'colour', what: 'auto', explode: 0, parallel: false, wire: true, mesh: false, fuzzy: true };
  if ([...$('shade').options].some(({ value }) => value === state.get('shade'))) look.shade = state.get('shade');
  if (state.get('show') === 'cells') look.what = 'cells';
  look.explode = Math.min(1.5, Math.max(0, Number(state.get('explode')) || 0));
  for (const [id, name] of Object.entries(checks)) { if (state.has(name)) look[name] = state.get(name) === '1'; $(id).checked = look[name]; }
  for (const clip of stage.clips) {
    const text = state.get(clip.axis);
    clip.on = text !== null;
    if (text === null) continue;
    clip.at = Math.min(1, Math.max(0, parseFloat(text) || 0));
    clip.flip = text.endsWith('-');
  }
  stage.hidden = new Set((state.get('hide') ?? '').split('.').filter((x) => x !== '').map(Number).filter(Number.isInteger));
  theme = ['dark', 'light'].includes(state.get('theme')) ? state.get('theme') : null;
  document.body.classList.toggle('closed', state.has('panel') ? state.get('panel') === '0' : innerWidth <= 720);
  $('shade').value = look.shade;
  $('what').value = look.what;
  $('explode').value = look.explode;
  const [eye, at] = [vector('eye'), vector('at')];
  if (eye && at && eye.join() !== at.join()) {
    stage.isAsked = true;
    stage.camera.position.set(...eye);
    stage.controls.target.set(...at);
    stage.controls.update();
  }
  const tall = parseFloat(state.get('parallel'));
  stage.setLook({ ...look, parallel: tall > 0 });
  if (tall > 0) { Object.assign(stage.parallel, { top: tall, bottom: -tall, zoom: 1 }); stage.resize(); }
  stage.updateClips();
  setTheme();
  makeClips();
}
addEventListener('hashchange', () => { recall(); setHidden(stage.hidden); });

// --- What comes ---

/** Another level of what is selected. */
function renewPicks() {
  const anew = picks.map((picked) => stage.pickedAnew(picked));
  const isOther = anew.some((picked, i) => picked !== picks[i]);
  picks = anew.filter((picked) => picked !== null);
  if (isOther) showSelection();
  else if (selectedPart !== null) stage.select(picks, selectedPart);
}

function changed(what) {
  if (what === 'drawn') { gaze.tellSoon(); return; }
  if (what === 'content') renewPicks();
  if (what === 'model' || what === 'shown' || what === 'content') {
    listParts();
    for (const clip of stage.clips) clip.update?.();
  }
  if (what === 'shown') { picks = picks.filter(({ run }) => run === stage.run); showSelection(); }
  if (what === undefined) remember();
}

function showState() {
  const badge = $('state');
  const states = { running: ['run', progress.superstep || 'running'], finished: figures && !figures.complete ? ['', 'not complete'] : ['good', 'finished'], failed: ['bad', 'failed'], stopped: ['bad', 'stopped'] };
  const [kind, text] = connection === 'open' ? states[progress.state] ?? ['', 'waiting'] : ['bad', connection === 'gone' ? 'bsp2 has ended' : 'connecting'];
  badge.dataset.kind = kind;
  badge.textContent = text;
}

function showProgress(message) {
  progress = message;
  document.title = `${message.model} – bsp2 view`;
  $('name').textContent = message.model;
  const isRunning = message.state === 'running';
  $('done').style.width = isRunning ? `${100 * message.done}%` : '0';
  if (isRunning) {
    if (!rateOf || rateOf.run !== message.run || message.cells < rateOf.cells) { rateOf = message; rate = 0; }
    else if (message.seconds - rateOf.seconds > 0.5) { rate = (message.cells - rateOf.cells) / (message.seconds - rateOf.seconds); rateOf = message; }
  }
  const item = (name, value, rare) => { const span = element('span', { className: rare ? 'rare' : '' }); span.append(element('b', { textContent: value }), ` ${name}`); return span; };
  const shown = [];
  if (isRunning) shown.push(item('', `${Math.floor(100 * message.done)} %`));
  shown.push(item(message.cells === 1 ? 'cell' : 'cells', count(message.cells)));
  if (isRunning && rate > 0) shown.push(item('cells/s', count(Math.round(rate))));
  shown.push(item('', time(message.seconds)), item('memory', bytes(message.memory)));
  if (message.pages > 1) shown.push(item('pages open', message.pages, true));
  $('progress').replaceChildren(...shown);
  if (message.state !== 'failed') $('error').hidden = true;
  showState();
}

function showFigures() {
  if (!figures) return;
  const f = figures;
  const size = f.lower.map((low, i) => number(f.upper[i] - low, 5));
  const plane = stage.model.dimension === 2;
  const rows = [[plane ? 'area' : 'volume', number(f.volume, 9)]];
  if (f.fuzzyCells > 0) rows.push([plane ? 'FUZZY area' : 'FUZZY volume', number(f.fuzzyVolume)]);
  rows.push(['surface area', f.area === undefined ? null : number(f.area, 9)], ['size', size.join(' × ') || null], ['cells', count(f.inCells)], ['FUZZY cells', f.fuzzyCells > 0 ? count(f.fuzzyCells) : null],
    ['triangles', f.triangles === undefined ? null : count(f.triangles)], ['primitives', count(f.primitives)], ['time', time(f.seconds)], ['most memory', bytes(f.memory)]);
  const shown = [facts(rows)];
  if ([...stage.pieces.values(), ...stage.regions.values()].some(({ message }) => message.coarse))
    shown.push(element('p', { className: 'quiet', textContent: 'There is more than the page shows: small things are left out of the picture. Start bsp2 view with more --triangles to see them.' }));
  for (const text of f.warnings) shown.push(element('p', { className: 'warn', textContent: text }));
  for (const text of f.notes) shown.push(element('p', { className: 'quiet', textContent: text }));
  $('facts').replaceChildren(...shown);
}

function receive(message) {
  if (message.kind === 'progress') { showProgress(message); return; }
  if (message.kind === 'error') {
    $('error').replaceChildren(element('b', { textContent: message.title ?? 'The model cannot be evaluated as it is saved now' }), message.text);
    $('error').hidden = false;
    return;
  }
  stage.receive(message);
  if (message.kind === 'model' && message.figures) figures = message.figures;
  if (message.kind === 'model') gaze.tell();
  if (message.kind === 'model' || message.kind === 'shown') { showFigures(); showState(); }
}

const gaze = new Gaze(() => gazeOf(stage, picks), (what) => line.say(what));

recall();
const line = connect({
  message: receive,
  seen: (number) => { gaze.seen = number; },
  state: (state) => {
    connection = state;
    if (state === 'open') { stage.forgetRun(); gaze.forget(); camera = ''; remember(); }
    showState();
  },
});
listParts();
showSelection();
/** For tests, and for whoever wants to know. */
window.bsp2 = { stage, stats: stage.stats, get progress() { return progress; }, get picks() { return picks; }, get isSatisfied() { return gaze.isSatisfied; } };
